// What every 3D picture of the console has: a camera that a hand turns, and drawing when something has changed.
//
// Units: metres.
import * as THREE from 'three'
import { OrbitControls } from 'three/addons/controls/OrbitControls.js'

const pause = 100 // [ms] between two drawings, at least

export class Stage {
  readonly world = new THREE.Scene()
  readonly camera = new THREE.PerspectiveCamera(40, 1, 0.01, 50)
  readonly controls: OrbitControls
  private readonly renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true })
  private waiting = false

  /** `up`: in the frame of what is drawn. `label`: for who cannot see it. */
  constructor(private readonly host: HTMLElement, up: THREE.Vector3, label: string) {
    const canvas = this.renderer.domElement
    canvas.tabIndex = 0
    canvas.setAttribute('role', 'img')
    canvas.setAttribute('aria-label', label)
    host.append(canvas)
    this.camera.up.copy(up)
    this.controls = new OrbitControls(this.camera, canvas)
    this.controls.addEventListener('change', () => this.draw())
    new ResizeObserver(() => this.fit()).observe(host)
  }

  /** Looks at `target` from `direction`, so far away that a ball of `radius` around it fills a good part of the view. */
  look(target: THREE.Vector3, direction: THREE.Vector3, radius: number): void {
    this.controls.target.copy(target)
    this.camera.position.copy(target).addScaledVector(direction.clone().normalize(), 5 * radius)
    this.controls.update()
    this.draw()
  }

  background(dark: boolean): void {
    this.renderer.setClearColor(dark ? 0x000000 : 0xffffff)
    this.draw()
  }

  draw(): void {
    if (this.waiting) return
    this.waiting = true
    setTimeout(() => {
      this.waiting = false
      this.renderer.render(this.world, this.camera)
    }, pause)
  }

  private fit(): void {
    const width = this.host.clientWidth
    if (width === 0) return
    const height = Math.round(Math.min(0.6 * width, 0.65 * window.innerHeight))
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio))
    this.renderer.setSize(width, height, false)
    this.renderer.domElement.style.height = `${height}px`
    this.camera.aspect = width / height
    this.camera.updateProjectionMatrix()
    this.draw()
  }
}

/** The sharp edges of a mesh, as lines. */
export function edgesOf(vertices: number[][], triangles: number[][], colour: number): THREE.LineSegments {
  const geometry = new THREE.BufferGeometry()
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(vertices.flat(), 3))
  geometry.setIndex(triangles.flat())
  return new THREE.LineSegments(new THREE.EdgesGeometry(geometry, 20), new THREE.LineBasicMaterial({ color: colour }))
}
