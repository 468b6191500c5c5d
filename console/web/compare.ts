// Clouds of sessions over the object, several over one another: coloured by verdict, error, sigma or cloud.
//
// Frame: o, the object's; z up. Units: metres.
import * as THREE from 'three'
import { byId, figure, make } from './page'
import { Fields, fieldsOf } from './ply'
import { edgesOf, Stage } from './stage'

interface Shown {
  name: string
  score: string
  fields: Fields
  points: THREE.Points
}

const most = 200_000 // points of one cloud
const own = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9']
const worst = 0.005 // [m]: the end of the colours of errors
const modes = ['verdict', 'error', 'sigma', 'cloud'] as const
type Mode = (typeof modes)[number]

/** The triangles of an OBJ. */
function meshOf(text: string): { vertices: number[][]; triangles: number[][] } {
  const vertices: number[][] = []
  const triangles: number[][] = []
  for (const line of text.split('\n')) {
    const [kind, ...words] = line.trim().split(/\s+/)
    if (kind === 'v') vertices.push(words.slice(0, 3).map(Number))
    if (kind === 'f') {
      const corners = words.map(word => Number(word.split('/')[0]) - 1)
      for (let i = 2; i < corners.length; ++i) triangles.push([corners[0], corners[i - 1], corners[i]])
    }
  }
  return { vertices, triangles }
}

interface Score {
  mean_error_m: number | null
  coverage: number | null
  outliers: number | null
}

/** Its figures, so that sessions compare; nothing where it has none. */
async function scoreOf(file: string): Promise<string> {
  const answer = await fetch(file)
  if (!answer.ok) return ''
  const score = (await answer.json()) as Score
  return `; mean error ${figure(score.mean_error_m, 1e3, 2, 'mm')}, coverage ${figure(score.coverage, 100, 1, '%')}, outliers ${figure(score.outliers, 100, 2, '%')} `
}

export class Compare {
  private readonly stage: Stage
  private readonly shown: Shown[] = []
  private readonly list = make('ul', { className: 'clouds' })
  private readonly says = make('p')
  private readonly host = make('div', { id: 'compare-view' })
  private mode: Mode = 'verdict'
  private hasMesh = false

  constructor() {
    const choice = make('div', { className: 'row' }, 'Coloured by ')
    for (const mode of modes) {
      const button = make('button', { type: 'button' }, mode === 'cloud' ? 'cloud, each its own' : mode)
      button.setAttribute('aria-pressed', String(mode === this.mode))
      button.addEventListener('click', () => {
        this.mode = mode
        for (const other of choice.querySelectorAll('button')) other.setAttribute('aria-pressed', String(other === button))
        this.paint()
      })
      choice.append(button)
    }
    byId('compare').replaceChildren(make('div', { className: 'box' }, choice, this.says, this.host, this.list))
    this.stage = new Stage(this.host, new THREE.Vector3(0, 0, 1), 'Clouds over the object, in 3D. Drag to turn, scroll to zoom.')
    this.stage.look(new THREE.Vector3(0, 0, -0.08), new THREE.Vector3(1, -1.2, 1), 0.2)
    this.background(document.body.classList.contains('dark'))
    this.say()
  }

  background(dark: boolean): void {
    this.stage.background(dark)
  }

  async add(session: string, method: string): Promise<void> {
    const name = `${session}, ${method}`
    if (this.shown.some(cloud => cloud.name === name)) return
    const place = `/sessions/${encodeURIComponent(session)}`
    const answer = await fetch(`${place}/clouds/${method}_verdict.ply`)
    if (!answer.ok) return this.say(`${session} has no scored cloud of ${method}.`)
    const fields = fieldsOf(await answer.arrayBuffer(), most)
    const n = fields.x.length
    const geometry = new THREE.BufferGeometry()
    const positions = new Float32Array(3 * n)
    for (let i = 0; i < n; ++i) positions.set([fields.x[i], fields.y[i], fields.z[i]], 3 * i)
    geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3))
    geometry.setAttribute('color', new THREE.BufferAttribute(new Uint8Array(3 * n), 3, true))
    const points = new THREE.Points(geometry, new THREE.PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true }))
    this.shown.push({ name, score: await scoreOf(`${place}/results/${method}.json`), fields, points })
    this.stage.world.add(points)
    if (!this.hasMesh) await this.addMesh(place)
    this.paint()
  }

  private async addMesh(place: string): Promise<void> {
    const session = await fetch(`${place}/session.yaml`)
    const file = session.ok ? /mesh: "?([^"\s,}]+\.obj)/.exec(await session.text())?.[1] : undefined
    if (!file) return
    const mesh = await fetch(`${place}/${encodeURIComponent(file)}`)
    if (!mesh.ok) return
    const { vertices, triangles } = meshOf(await mesh.text())
    this.stage.world.add(edgesOf(vertices, triangles, 0x808890))
    this.hasMesh = true
  }

  private say(what = ''): void {
    const legend = { verdict: 'object green, ground black, outliers blue, rejected grey', error: `distance to the surface: ground grey, green 0, yellow ${500 * worst} mm, red ${1000 * worst} mm and more`, sigma: `one sigma along the ray: ground grey, green 0, yellow ${500 * worst} mm, red ${1000 * worst} mm and more`, cloud: 'each cloud its own colour' }
    this.host.hidden = this.shown.length === 0
    this.says.textContent = what || (this.shown.length === 0 ? 'Choose clouds in Sessions: Show laser, Show stereo.' : legend[this.mode])
  }

  private colour(cloud: Shown, index: number, i: number, to: THREE.Color): void {
    const { fields } = cloud
    const value = this.mode === 'error' ? fields.error : this.mode === 'sigma' ? fields.sigma : undefined
    if (this.mode === 'cloud') to.set(own[index % own.length])
    else if (value && fields.red[i] === fields.green[i] && fields.green[i] === fields.blue[i]) to.set(0xb0b4b8) // not the object's
    else if (value) to.setHSL(0.33 * (1 - Math.min(1, value[i] / worst)), 1, 0.4)
    else to.setRGB(fields.red[i] / 255, fields.green[i] / 255, fields.blue[i] / 255)
  }

  private paint(): void {
    const colour = new THREE.Color()
    const dark = document.body.classList.contains('dark')
    this.shown.forEach((cloud, index) => {
      const attribute = cloud.points.geometry.getAttribute('color') as THREE.BufferAttribute
      for (let i = 0; i < cloud.fields.x.length; ++i) {
        this.colour(cloud, index, i, colour)
        const grey = dark ? 0.2 : 0 // black on black is nothing
        attribute.setXYZ(i, Math.max(grey, colour.r), colour.g, colour.b)
      }
      attribute.needsUpdate = true
    })
    this.list.replaceChildren(
      ...this.shown.map((cloud, index) => {
        const seen = make('input', { type: 'checkbox', checked: cloud.points.visible })
        seen.addEventListener('change', () => { cloud.points.visible = seen.checked; this.stage.draw() })
        const away = make('button', { type: 'button' }, 'Take away')
        away.addEventListener('click', () => {
          this.stage.world.remove(cloud.points)
          cloud.points.geometry.dispose()
          this.shown.splice(index, 1)
          this.paint()
        })
        const swatch = make('span', { className: 'swatch' })
        swatch.style.background = own[index % own.length]
        return make('li', {}, swatch, make('label', {}, seen, ` ${cloud.name}: ${cloud.fields.x.length} points shown${cloud.score}`), away)
      }),
    )
    this.say()
    this.stage.draw()
  }
}
