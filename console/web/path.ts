// The planned scan before it runs: arm, sheet, object, cameras and tank in 3D, along the path, with the clearance.
//
// Frame: b, the arm's base; its z points down into the tank, so up is -z. Units: metres.
import * as THREE from 'three'
import { ask, make } from './page'
import { edgesOf, Stage } from './stage'

type Point = [number, number, number]
interface Pose {
  t_s: number
  segment: string
  laser: boolean
  arm: Point[]
  sheet: Point[]
  clearance_m: number
  pair: string
}
interface Drawing {
  cameras: { name: string; lines: Point[] }[]
  object?: { vertices: number[][]; triangles: number[][] } | null
  tank: Point[]
  link_radius_m: number
  margin_m: number
  poses: Pose[]
  nearest: { t_s: number; segment: string; clearance_m: number; pair: string; points: [Point, Point] }
}

const colours = {
  light: { ink: 0x707880, arm: 0xb08000, lit: 0xc2007a, dark: 0x9aa2a8, nearest: 0xc4001a },
  dark: { ink: 0x802018, arm: 0xff8a7a, lit: 0xff4a3a, dark: 0x803028, nearest: 0xffd0c8 },
}
const play = 60 // [ms] between two poses

const vector = (p: Point) => new THREE.Vector3(...p)
const millimetres = (m: number) => `${(1e3 * m).toFixed(0)} mm`

const hand = (pose: Pose) => vector(pose.arm[pose.arm.length - 1])

/** Everything in the group is freed, too. */
function empty(group: THREE.Group): void {
  group.traverse(part => {
    if (part instanceof THREE.Mesh || part instanceof THREE.Line) part.geometry.dispose()
  })
  group.clear()
}

export class PathView {
  private stage: Stage | undefined
  private readonly fixed = new THREE.Group()
  private readonly moving = new THREE.Group()
  private readonly button = make('button', { type: 'button', id: 'show-path' }, 'Show the planned path')
  private readonly view = make('div', { id: 'path-view' })
  private readonly says = make('p', { id: 'path-says' })
  private readonly nearest = make('p', { id: 'path-nearest' })
  private readonly time = make('input', { type: 'range', min: '0', value: '0', step: '1', id: 'path-time' })
  private readonly curve = document.createElementNS('http://www.w3.org/2000/svg', 'svg')
  private readonly problem = make('p', { className: 'bad' })
  private readonly shown = make('div', { hidden: true })
  private drawing: Drawing | undefined
  private dark = false
  private playing: number | undefined

  /** `preset`: which one is chosen in the form; '' for none. */
  constructor(private readonly host: HTMLElement, private readonly preset: () => string) {
    this.time.setAttribute('aria-label', 'Time along the path')
    this.nearest.setAttribute('role', 'status')
    this.curve.setAttribute('role', 'img')
    const run = make('button', { type: 'button' }, 'Play')
    run.addEventListener('click', () => this.play())
    const nearest = make('button', { type: 'button' }, 'Where it is nearest')
    nearest.addEventListener('click', () => {
      if (this.drawing) this.go(this.index(this.drawing.nearest.t_s))
    })
    this.button.addEventListener('click', () => void this.load())
    this.time.addEventListener('input', () => {
      this.pause()
      this.go(Number(this.time.value))
    })
    this.shown.append(this.view, this.time, this.curve, make('div', { className: 'row' }, run, nearest), this.says, this.nearest)
    host.append(make('h2', {}, 'Planned path'), make('div', { className: 'row' }, this.button), this.problem, this.shown)
  }

  /** Only of a scan; one of other settings than those in the form is not shown. */
  offer(scan: boolean): void {
    this.host.hidden = !scan
    this.forget()
  }

  forget(): void {
    this.pause()
    this.drawing = undefined
    this.shown.hidden = true
    this.problem.textContent = ''
    this.button.textContent = 'Show the planned path'
  }

  colour(dark: boolean): void {
    this.dark = dark
    this.stage?.background(dark)
    if (!this.drawing) return
    this.build()
    this.go(Number(this.time.value))
  }

  private async load(): Promise<void> {
    const preset = this.preset()
    this.forget()
    this.button.disabled = true
    this.button.textContent = 'The dry run is made'
    try {
      const answer = (await ask(preset ? `path/${encodeURIComponent(preset)}` : 'path')) as { drawing: Drawing }
      if (preset !== this.preset()) return
      this.drawing = answer.drawing
      this.show()
    } catch (problem) {
      this.problem.textContent = problem instanceof Error ? problem.message : String(problem)
    } finally {
      this.button.disabled = false
      this.button.textContent = this.drawing ? 'Make the dry run anew' : 'Show the planned path'
    }
  }

  private show(): void {
    const drawing = this.drawing!
    this.shown.hidden = false
    if (!this.stage) {
      this.stage = new Stage(this.view, new THREE.Vector3(0, 0, -1), 'The planned path in 3D: arm, laser sheet, object and cameras. Drag to turn, scroll to zoom.')
      this.stage.background(this.dark)
      this.stage.world.add(this.fixed, this.moving)
    }
    this.time.max = String(drawing.poses.length - 1)
    this.build()
    const seen = [...drawing.poses.flatMap(pose => pose.arm), ...((drawing.object?.vertices ?? []) as Point[])]
    const ball = new THREE.Box3().setFromPoints(seen.map(vector)).getBoundingSphere(new THREE.Sphere())
    this.stage.look(ball.center, new THREE.Vector3(-0.5, -1.2, -0.55), 0.62 * ball.radius)
    const { nearest } = drawing
    this.nearest.textContent = `Nearest on the whole path: ${millimetres(nearest.clearance_m)}, ${nearest.pair}, ${nearest.t_s.toFixed(1)} s, ${nearest.segment}. Less than ${millimetres(drawing.margin_m)} is refused.`
    this.drawCurve()
    this.go(0)
  }

  /** What stands still: the rig, the way of the arm's end, and where it comes nearest to anything. */
  private build(): void {
    const drawing = this.drawing!
    const colour = this.dark ? colours.dark : colours.light
    empty(this.fixed)
    const line = (points: Point[], ink: number) => this.fixed.add(new THREE.Line(new THREE.BufferGeometry().setFromPoints(points.map(vector)), new THREE.LineBasicMaterial({ color: ink })))
    for (const camera of drawing.cameras) line(camera.lines, colour.ink)
    if (drawing.object) this.fixed.add(edgesOf(drawing.object.vertices, drawing.object.triangles, colour.ink))
    const floor = drawing.tank.slice(0, 4)
    line([...floor, floor[0]], colour.dark)
    for (const laser of [false, true]) {
      const steps = drawing.poses.flatMap((pose, i) => (i > 0 && pose.laser === laser ? [hand(drawing.poses[i - 1]), hand(pose)] : []))
      this.fixed.add(new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(steps), new THREE.LineBasicMaterial({ color: laser ? colour.lit : colour.dark })))
    }
    const [there, here] = drawing.nearest.points
    line([there, here], colour.nearest)
    for (const end of [there, here]) {
      const ball = new THREE.Mesh(new THREE.SphereGeometry(0.012, 12, 8), new THREE.MeshBasicMaterial({ color: colour.nearest }))
      ball.position.copy(vector(end))
      this.fixed.add(ball)
    }
  }

  private index(t_s: number): number {
    const { poses } = this.drawing!
    return poses.reduce((best, pose, i) => (Math.abs(pose.t_s - t_s) < Math.abs(poses[best].t_s - t_s) ? i : best), 0)
  }

  /** The arm and the sheet as they are at one pose. */
  private go(at: number): void {
    const drawing = this.drawing!
    const pose = drawing.poses[at]
    const colour = this.dark ? colours.dark : colours.light
    this.time.value = String(at)
    empty(this.moving)
    for (let i = 1; i < pose.arm.length; ++i) this.link(vector(pose.arm[i - 1]), vector(pose.arm[i]), drawing.link_radius_m, colour.arm)
    if (pose.laser) {
      const geometry = new THREE.BufferGeometry().setFromPoints(pose.sheet.map(vector))
      this.moving.add(new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: colour.lit, transparent: true, opacity: 0.3, side: THREE.DoubleSide, depthWrite: false })))
      this.moving.add(new THREE.LineLoop(geometry, new THREE.LineBasicMaterial({ color: colour.lit })))
    }
    this.says.textContent = `${pose.t_s.toFixed(1)} of ${drawing.poses[drawing.poses.length - 1].t_s.toFixed(1)} s, ${pose.segment}, laser ${pose.laser ? 'on' : 'off'}; nearest here: ${millimetres(pose.clearance_m)}, ${pose.pair}`
    this.curve.querySelector('.now')?.setAttribute('x1', String(at))
    this.curve.querySelector('.now')?.setAttribute('x2', String(at))
    this.stage!.draw()
  }

  private link(from: THREE.Vector3, to: THREE.Vector3, radius: number, ink: number): void {
    const way = to.clone().sub(from)
    const material = new THREE.MeshBasicMaterial({ color: ink, transparent: true, opacity: 0.45 })
    const ends = new THREE.Mesh(new THREE.SphereGeometry(radius, 16, 12), material)
    ends.position.copy(to)
    this.moving.add(ends)
    this.moving.add(new THREE.Line(new THREE.BufferGeometry().setFromPoints([from, to]), new THREE.LineBasicMaterial({ color: ink })))
    if (way.length() < 1e-6) return
    const body = new THREE.Mesh(new THREE.CylinderGeometry(radius, radius, way.length(), 16, 1, true), material)
    body.position.copy(from).addScaledVector(way, 0.5)
    body.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), way.normalize())
    this.moving.add(body)
  }

  /** Clearance over time, with the margin. */
  private drawCurve(): void {
    const { poses, margin_m, nearest } = this.drawing!
    const most = Math.max(...poses.map(pose => pose.clearance_m), 2 * margin_m)
    const height = 60
    const y = (m: number) => height * (1 - Math.max(0, m) / most)
    const add = (tag: string, attributes: Record<string, string | number>) => {
      const made = document.createElementNS('http://www.w3.org/2000/svg', tag)
      for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value))
      this.curve.append(made)
    }
    this.curve.replaceChildren()
    this.curve.setAttribute('viewBox', `0 0 ${poses.length - 1} ${height}`)
    this.curve.setAttribute('preserveAspectRatio', 'none')
    this.curve.setAttribute('class', 'clearance')
    this.curve.setAttribute('aria-label', `Clearance along the path: at least ${millimetres(nearest.clearance_m)}`)
    poses.forEach((pose, i) => {
      if (pose.laser) add('rect', { x: i - 0.5, y: 0, width: 1, height, class: 'with-laser' })
    })
    add('line', { x1: 0, x2: poses.length - 1, y1: y(margin_m), y2: y(margin_m), class: 'margin' })
    add('polyline', { points: poses.map((pose, i) => `${i},${y(pose.clearance_m).toFixed(2)}`).join(' '), class: 'curve' })
    add('line', { x1: 0, x2: 0, y1: 0, y2: height, class: 'now' })
  }

  private play(): void {
    if (this.playing !== undefined) return this.pause()
    this.playing = window.setInterval(() => {
      const next = Number(this.time.value) + 1
      if (!this.drawing || next >= this.drawing.poses.length) return this.pause()
      this.go(next)
    }, play)
  }

  private pause(): void {
    window.clearInterval(this.playing)
    this.playing = undefined
  }
}
