// The cloud as it grows, over the object, with the cameras and the arm.
//
// Frame: b, the arm's base; its z points down into the tank, so up is -z. Units: metres.
import * as THREE from 'three'
import { edgesOf, Stage } from './stage'

export interface SceneMessage {
  cameras: { name: string; lines: number[][] }[]
  object?: { vertices: number[][]; triangles: number[][] } | null
}

const first = 1 << 16 // points there is room for in the beginning
const most = 2_000_000

export class Cloud {
  private readonly stage: Stage
  private readonly fixed = new THREE.Group()
  private readonly arm = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial())
  private readonly points = new THREE.Points(
    new THREE.BufferGeometry(),
    new THREE.PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true }),
  )
  private place = new Float32Array(3 * first)
  private tint = new Uint8Array(3 * first)
  private heights: [number, number] = [0.9, 1.2] // z [m]: the colours' ends
  private dark = false
  private ink = 0
  count = 0

  constructor(host: HTMLElement) {
    this.stage = new Stage(host, new THREE.Vector3(0, 0, -1), 'The growing cloud, in 3D. Drag to turn, scroll to zoom.')
    this.points.frustumCulled = false
    this.arm.frustumCulled = false
    this.stage.world.add(this.fixed, this.arm, this.points)
    this.stage.look(new THREE.Vector3(0.6, 0, 0.6), new THREE.Vector3(-1.2, -1.2, -1.2), 0.35)
    this.clear()
    this.colour(false)
  }

  colour(dark: boolean): void {
    this.dark = dark
    this.ink = dark ? 0x802018 : 0x707880
    this.arm.material.color.set(dark ? 0xff8a7a : 0xb08000)
    this.fixed.traverse(part => {
      if (part instanceof THREE.Line) part.material.color.set(this.ink)
    })
    this.paint(0, this.count)
    this.stage.background(dark)
  }

  clear(): void {
    this.count = 0
    this.reserve(first)
    this.stage.draw()
  }

  setScene(message: SceneMessage): void {
    this.fixed.clear()
    for (const camera of message.cameras) {
      const geometry = new THREE.BufferGeometry().setFromPoints(camera.lines.map(p => new THREE.Vector3(...p)))
      this.fixed.add(new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: this.ink })))
    }
    if (message.object) {
      const z = message.object.vertices.map(p => p[2])
      this.heights = [Math.min(...z), Math.max(...z)]
      this.fixed.add(edgesOf(message.object.vertices, message.object.triangles, this.ink))
      const ball = new THREE.Box3().setFromPoints(message.object.vertices.map(p => new THREE.Vector3(...p))).getBoundingSphere(new THREE.Sphere())
      // From the first camera's side, but past it: its pyramid would fill the view.
      const eye = message.cameras[0]?.lines[0] ?? [-1, -1, -1]
      const aside = new THREE.Vector3(...eye).sub(ball.center).applyAxisAngle(new THREE.Vector3(0, 0, 1), 0.9)
      this.stage.look(ball.center, aside, ball.radius)
    }
    this.stage.draw()
  }

  setArm(points: number[][]): void {
    this.arm.geometry.dispose()
    this.arm.geometry = new THREE.BufferGeometry().setFromPoints(points.map(p => new THREE.Vector3(...p)))
    this.stage.draw()
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
    this.stage.draw()
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
}
