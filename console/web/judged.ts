// The guided calibration's pictures: the newest of each camera, what was found in it, and what it is worth.
import { byId, make } from './page'

export interface JudgedMessage {
  target: 'board' | 'marker' | 'sheet'
  picture: number
  enough: number // pictures of a camera that must count
  missing: string // empty: nothing
  cameras: { name: string; found: string; counts: boolean; why_not: string; pictures: number; so_far: string }[]
}

const prefix = 'judged: '
const titles = { board: 'Board', marker: 'Marker in the gripper', sheet: "The laser's sheet" }

/** Of a picture's name, the camera; nothing if it is none that was judged. */
export const judgedCamera = (name: string) => (name.startsWith(prefix) ? name.slice(prefix.length) : undefined)

export class Judged {
  private readonly box = byId('judged-box')
  private readonly place = byId('judged')
  private readonly of = new Map<string, { image: HTMLImageElement; says: HTMLElement; counted: HTMLProgressElement; covered: HTMLElement }>()
  private target = ''

  clear(): void {
    this.of.clear()
    this.place.replaceChildren()
    byId('judged-missing').textContent = ''
    this.box.hidden = true
  }

  picture(camera: string): HTMLImageElement {
    return this.figure(camera).image
  }

  show(message: JudgedMessage): void {
    if (message.target !== this.target) this.clear() // the next step, of other cameras
    this.target = message.target
    byId('judged-title').textContent = `${titles[message.target]}, picture ${message.picture}`
    byId('judged-missing').textContent = message.missing === '' ? 'Enough pictures count.' : `Still missing: ${message.missing}.`
    for (const camera of message.cameras) {
      const { says, counted, covered } = this.figure(camera.name)
      says.textContent = camera.counts ? `counts: ${camera.found}` : `does not count: ${camera.why_not}`
      says.className = camera.counts ? 'good' : 'bad'
      counted.max = message.enough
      counted.value = camera.pictures
      covered.textContent = `${camera.pictures} of ${message.enough} pictures; ${camera.so_far}`
    }
  }

  private figure(camera: string) {
    const known = this.of.get(camera)
    if (known) return known
    const image = make('img', { alt: `What camera ${camera} saw last, with what was found in it` })
    const [says, covered] = [make('p', { role: 'status' }), make('p')]
    const counted = make('progress', { value: 0, max: 1 })
    counted.setAttribute('aria-label', `Pictures of ${camera} that count`)
    const fresh = { image, says, counted, covered }
    this.of.set(camera, fresh)
    this.place.append(make('figure', { className: 'box' }, make('figcaption', {}, camera), image, says, counted, covered))
    this.box.hidden = false
    return fresh
  }
}
