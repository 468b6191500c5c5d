// Clicking the object's corners: the picture, a magnifier, and which corner is which by the rig file's drawing of it.
//
// Pixels: column, row; the centre of the top-left pixel is 0, 0.
import { byId, make } from './page'

export interface ToClick {
  camera: string
  width_px: number
  height_px: number
  corners: { name: string; pixel_px: [number, number] | null; seen: boolean }[]
  edges: ([number, number] | null)[][]
}

type Pixel = [number, number]

/** Of what `tankrig calibrate object --json` tells. */
export interface ObjectPose {
  raw_rms_px: number
  rms_px: number
  surface_sigma_mm: number
  corners: { name: string; clicked_px: Pixel; snapped_px?: Pixel; not_snapped?: string }[]
}

const zoom = 8
const fewest = 4
const clickedColour = '#ff2060'
const snappedColour = '#20e060'
const nudges: Record<string, Pixel> = { ArrowLeft: [-0.25, 0], ArrowRight: [0.25, 0], ArrowUp: [0, -0.25], ArrowDown: [0, 0.25] }

/** `save` gets the clicks; `goOn` runs the calibration again, which goes on where it stopped. */
export class Corners {
  private readonly clicks = new Map<string, Pixel>()
  private snapped: ObjectPose['corners'] = []
  private readonly picture = new Image()
  private readonly canvas = make('canvas', { tabIndex: 0 })
  private readonly lens = make('canvas', { width: 160, height: 160, className: 'lens' })
  private readonly list = make('div', { className: 'row' })
  private readonly says = make('p')
  private readonly folder: HTMLInputElement
  private readonly saving: HTMLButtonElement
  private readonly clicking: HTMLElement
  private readonly brightness = make('input', { type: 'range', min: '1', max: '6', step: '0.1', value: '1' })
  private chosen = ''
  private at: Pixel = [0, 0]

  constructor(
    private readonly rig: ToClick,
    folder: string,
    private readonly save: (folder: string, corners: { name: string; pixel_px: Pixel }[]) => void,
    goOn: () => void,
  ) {
    this.folder = make('input', { type: 'text', value: folder })
    this.saving = make('button', { type: 'button', className: 'main', disabled: true }, 'Save the corners')
    this.clicking = make('div', { hidden: true }, this.list, make('div', { className: 'clicking' }, this.canvas, this.lens))
    const load = make('button', { type: 'button' }, 'Show the picture')
    const further = make('button', { type: 'button' }, 'Go on calibrating')
    load.addEventListener('click', () => this.load())
    further.addEventListener('click', goOn)
    this.saving.addEventListener('click', () => this.save(this.folder.value, [...this.clicks].map(([name, pixel_px]) => ({ name, pixel_px }))))
    this.brightness.addEventListener('input', () => this.draw())
    this.canvas.setAttribute('aria-label', 'The picture: click the chosen corner; arrow keys move it by a quarter of a pixel')
    this.canvas.addEventListener('pointermove', event => { this.at = this.pixelOf(event); this.magnify() })
    this.canvas.addEventListener('click', event => this.click(this.pixelOf(event)))
    this.canvas.addEventListener('keydown', event => this.nudge(event))
    this.picture.addEventListener('load', () => {
      this.canvas.width = this.picture.naturalWidth
      this.canvas.height = this.picture.naturalHeight
      this.clicking.hidden = false
      this.clicks.clear()
      this.snapped = []
      this.choose(rig.corners.find(corner => corner.seen)?.name ?? rig.corners[0].name)
      this.say(`Click ${fewest} corners or more, all that can be seen. The drawing shows where the rig file has them: it tells them apart, no more.`)
    })
    this.picture.addEventListener('error', () => {
      this.clicking.hidden = true
      this.saving.disabled = true
      this.say('That folder has no object.png yet: calibrate first, its last step asks for the corners.')
    })
    byId('corners').replaceChildren(
      make('div', { className: 'box' },
        make('div', { className: 'row' }, make('label', {}, 'Folder ', this.folder), load, this.saving, further, make('label', {}, 'Brighter ', this.brightness)),
        this.says, this.clicking),
    )
    this.load()
  }

  saved(file: string): void {
    this.say(`Saved as ${file}. Its corners are being snapped to the object's edges.`)
  }

  /** Where the corners that were saved snap to. */
  snaps(pose: ObjectPose): void {
    this.snapped = pose.corners
    this.say(
      `The clicks err by ${pose.raw_rms_px.toFixed(2)} px; snapped to the edges (green) by ${pose.rms_px.toFixed(2)} px, which puts the object's surface off by ${pose.surface_sigma_mm.toFixed(2)} mm (one sigma). Go on calibrating, or click better and save again.`,
    )
    this.choose(this.chosen)
  }

  /** Nothing if the corner has been clicked elsewhere since. */
  private snapOf(name: string): ObjectPose['corners'][0] | undefined {
    return this.snapped.find(corner => corner.name === name && this.clicks.get(name)?.every((at, i) => Math.abs(at - corner.clicked_px[i]) < 0.01))
  }

  private moved(name: string): string {
    const corner = this.snapOf(name)
    if (!corner) return ''
    if (!corner.snapped_px) return `, not snapped: ${corner.not_snapped}`
    return `, snapped by ${Math.hypot(corner.snapped_px[0] - corner.clicked_px[0], corner.snapped_px[1] - corner.clicked_px[1]).toFixed(2)} px`
  }

  private load(): void {
    this.picture.src = `/sessions/${encodeURIComponent(this.folder.value)}/object.png?${Date.now()}`
  }

  private say(text: string): void {
    this.says.textContent = text
  }

  private pixelOf(event: MouseEvent): Pixel {
    const box = this.canvas.getBoundingClientRect()
    return [((event.clientX - box.left) * this.canvas.width) / box.width - 0.5, ((event.clientY - box.top) * this.canvas.height) / box.height - 0.5]
  }

  private choose(name: string): void {
    this.chosen = name
    this.list.replaceChildren(
      ...this.rig.corners.map(corner => {
        const pixel = this.clicks.get(corner.name)
        const where = pixel ? ` ${pixel[0].toFixed(1)}, ${pixel[1].toFixed(1)}` : corner.seen ? '' : ' hidden'
        const button = make('button', { type: 'button' }, corner.name + where + this.moved(corner.name))
        button.setAttribute('aria-pressed', String(corner.name === name))
        button.addEventListener('click', () => this.choose(corner.name))
        return button
      }),
    )
    this.saving.disabled = this.clicks.size < fewest
    this.draw()
  }

  private click(pixel: Pixel): void {
    this.clicks.set(this.chosen, pixel)
    const next = this.rig.corners.find(corner => corner.seen && !this.clicks.has(corner.name))
    this.canvas.focus()
    this.choose(next?.name ?? this.chosen)
  }

  /** The chosen corner, or the one clicked last if that one has no place yet. */
  private nudge(event: KeyboardEvent): void {
    const by = nudges[event.key]
    const name = this.clicks.has(this.chosen) ? this.chosen : [...this.clicks.keys()].pop()
    const pixel = name && this.clicks.get(name)
    if (!by || !name || !pixel) return
    event.preventDefault()
    this.at = [pixel[0] + by[0], pixel[1] + by[1]]
    this.clicks.set(name, this.at)
    this.choose(this.chosen)
    this.magnify()
  }

  private draw(): void {
    const pen = this.canvas.getContext('2d')
    if (!pen || this.canvas.width === 0) return
    pen.filter = `brightness(${this.brightness.value})`
    pen.drawImage(this.picture, 0, 0)
    pen.filter = 'none'
    pen.lineWidth = 1
    pen.strokeStyle = '#ffd040'
    pen.setLineDash([4, 4])
    pen.beginPath()
    for (const [a, b] of this.rig.edges)
      if (a && b) {
        pen.moveTo(a[0] + 0.5, a[1] + 0.5)
        pen.lineTo(b[0] + 0.5, b[1] + 0.5)
      }
    pen.stroke()
    pen.setLineDash([])
    pen.font = '14px sans-serif'
    for (const corner of this.rig.corners) {
      if (corner.pixel_px && corner.seen) {
        pen.fillStyle = corner.name === this.chosen ? '#ffffff' : '#ffd040'
        pen.fillText(corner.name, corner.pixel_px[0] + 6, corner.pixel_px[1] - 6)
      }
      const pixel = this.clicks.get(corner.name)
      if (pixel) this.cross(pen, pixel[0] + 0.5, pixel[1] + 0.5, 6, clickedColour)
      const to = this.snapOf(corner.name)?.snapped_px
      if (to) this.cross(pen, to[0] + 0.5, to[1] + 0.5, 6, snappedColour)
    }
    this.magnify()
  }

  private cross(pen: CanvasRenderingContext2D, x: number, y: number, size: number, colour: string): void {
    pen.strokeStyle = colour
    pen.beginPath()
    pen.moveTo(x - size, y)
    pen.lineTo(x + size, y)
    pen.moveTo(x, y - size)
    pen.lineTo(x, y + size)
    pen.stroke()
  }

  private magnify(): void {
    const pen = this.lens.getContext('2d')
    if (!pen || this.canvas.width === 0) return
    const part = this.lens.width / zoom
    pen.imageSmoothingEnabled = false
    pen.fillStyle = '#000'
    pen.fillRect(0, 0, this.lens.width, this.lens.height)
    pen.filter = `brightness(${this.brightness.value})`
    pen.drawImage(this.picture, this.at[0] + 0.5 - part / 2, this.at[1] + 0.5 - part / 2, part, part, 0, 0, this.lens.width, this.lens.height)
    pen.filter = 'none'
    this.cross(pen, this.lens.width / 2, this.lens.height / 2, 12, clickedColour)
    for (const { name } of this.snapped) {
      const to = this.snapOf(name)?.snapped_px
      if (to) this.cross(pen, this.lens.width / 2 + (to[0] - this.at[0]) * zoom, this.lens.height / 2 + (to[1] - this.at[1]) * zoom, 12, snappedColour)
    }
  }
}
