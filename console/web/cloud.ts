// The cloud as it grows, over the object, with the cameras and the arm.
//
// Frame: b, the arm's base; its z points down into the tank, so up is -z. Units: metres.
import * as THREE from 'three'
import { OrbitControls } from 'three/addons/controls/OrbitControls.js'

export interface SceneMessage {
  cameras: { name: string; lines: number[][] }[]
  object?: { vertices: number[][]; triangles: number[][] } | null
}

const first = 1 << 16 // points there is room for in the beginning
const most = 2_000_000

/** Draws when something has changed, at most ten times a second. */
export class Cloud {
  private readonly renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true })
  private readonly world = new THREE.Scene()
  private readonly camera = new THREE.PerspectiveCamera(40, 1, 0.01, 50)
  private readonly controls: OrbitControls
  private readonly fixed = new THREE.Group()
  private readonly arm = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial())
  private readonly material = new THREE.PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true })
  private points = new THREE.Points(new THREE.BufferGeometry(), this.material)
  private place = new Float32Array(3 * first)
  private tint = new Uint8Array(3 * first)
  private heights: [number, number] = [0.9, 1.2] // z [m]: the colours' ends
  private dark = false
  private waiting = false
  private ink = 0
  count = 0

  constructor(private readonly host: HTMLElement) {
    const canvas = this.renderer.domElement
    canvas.tabIndex = 0
    canvas.setAttribute('role', 'img')
    canvas.setAttribute('aria-label', 'The growing cloud, in 3D. Drag to turn, scroll to zoom.')
    host.append(canvas)
    this.camera.up.set(0, 0, -1)
    this.camera.position.set(-0.6, -1.2, -0.6)
    this.controls = new OrbitControls(this.camera, canvas)
    this.controls.target.set(0.6, 0, 0.6)
    this.controls.addEventListener('change', () => this.draw())
    this.points.frustumCulled = false
    this.arm.frustumCulled = false
    this.world.add(this.fixed, this.arm, this.points)
    this.clear()
    this.colour(false)
    new ResizeObserver(() => this.fit()).observe(host)
  }

  colour(dark: boolean): void {
    this.renderer.setClearColor(dark ? 0x000000 : 0xffffff)
    this.ink = dark ? 0x802018 : 0x707880
    this.dark = dark
    this.paint(0, this.count)
    this.arm.material.color.set(dark ? 0xff8a7a : 0xb08000)
    this.fixed.traverse(part => {
      if (part instanceof THREE.LineSegments || part instanceof THREE.Line) part.material.color.set(this.ink)
    })
    this.draw()
  }

  clear(): void {
    this.count = 0
    this.reserve(first)
    this.draw()
  }

  setScene(message: SceneMessage): void {
    this.fixed.clear()
    const lines = () => new THREE.LineBasicMaterial({ color: this.ink })
    for (const camera of message.cameras) {
      const geometry = new THREE.BufferGeometry().setFromPoints(camera.lines.map(p => new THREE.Vector3(...p)))
      this.fixed.add(new THREE.Line(geometry, lines()))
    }
    if (message.object) {
      const geometry = new THREE.BufferGeometry()
      geometry.setAttribute('position', new THREE.Float32BufferAttribute(message.object.vertices.flat(), 3))
      geometry.setIndex(message.object.triangles.flat())
      const edges = new THREE.EdgesGeometry(geometry, 20)
      this.fixed.add(new THREE.LineSegments(edges, lines()))
      const z = message.object.vertices.map(p => p[2])
      this.heights = [Math.min(...z), Math.max(...z)]
      geometry.computeBoundingSphere()
      const ball = geometry.boundingSphere
      if (ball) {
        // As the first camera sees it, from its side but nearer.
        const eye = message.cameras[0]?.lines[0]
        const from = eye ? new THREE.Vector3(...eye).sub(ball.center).normalize() : new THREE.Vector3(-0.5, -0.6, -0.6).normalize()
        this.controls.target.copy(ball.center)
        this.camera.position.copy(ball.center).addScaledVector(from, 5 * ball.radius)
        this.controls.update()
      }
    }
    this.draw()
  }

  setArm(points: number[][]): void {
    this.arm.geometry.dispose()
    this.arm.geometry = new THREE.BufferGeometry().setFromPoints(points.map(p => new THREE.Vector3(...p)))
    this.draw()
  }

  /** `data`: x, y, z of each. */
  add(data: Float32Array): void {
    const n = Math.min(data.length / 3, most - this.count)
    if (3 * (this.count + n) > this.place.length) this.reserve(2 * (this.count + n))
    this.place.set(data.subarray(0, 3 * n), 3 * this.count)
    this.count += n
    this.paint(this.count - n, n)
    this.renew('position', this.count - n, n)
    this.points.geometry.setDrawRange(0, this.count)
    this.draw()
  }

  /** By height over the object's foot: blue to green, or, in a dark room, dark red to light red. */
  private paint(from: number, n: number): void {
    const [top, foot] = this.heights
    const colour = new THREE.Color()
    for (let i = from; i < from + n; ++i) {
      const share = Math.min(1, Math.max(0, (foot - this.place[3 * i + 2]) / (foot - top)))
      if (this.dark) colour.setRGB(0.35 + 0.65 * share, 0.35 * share, 0.3 * share)
      else colour.setHSL(0.62 - 0.3 * share, 1, 0.35)
      this.tint.set([255 * colour.r, 255 * colour.g, 255 * colour.b], 3 * i)
    }
    this.renew('color', from, n)
  }

  private renew(name: string, from: number, n: number): void {
    const attribute = this.points.geometry.getAttribute(name) as THREE.BufferAttribute | undefined
    if (!attribute) return
    attribute.addUpdateRange(3 * from, 3 * n)
    attribute.needsUpdate = true
  }

  private reserve(points: number): void {
    const larger = new Float32Array(3 * points)
    larger.set(this.place.subarray(0, 3 * this.count))
    this.place = larger
    const tints = new Uint8Array(3 * points)
    tints.set(this.tint.subarray(0, 3 * this.count))
    this.tint = tints
    this.points.geometry.dispose()
    this.points.geometry = new THREE.BufferGeometry()
    this.points.geometry.setAttribute('position', new THREE.BufferAttribute(larger, 3))
    this.points.geometry.setAttribute('color', new THREE.BufferAttribute(tints, 3, true))
    this.points.geometry.setDrawRange(0, this.count)
  }

  private draw(): void {
    if (this.waiting) return
    this.waiting = true
    setTimeout(() => {
      this.waiting = false
      this.renderer.render(this.world, this.camera)
    }, 100)
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
