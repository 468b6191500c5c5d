// What a run shows of its results while it lasts: the cameras' pictures, the methods' scores, curves.
import { ScoreOf } from './messages'
import { byId, figure, make } from './page'

/** Draws other data in an image; those before are let go. */
export function renew(image: HTMLImageElement, data: Blob): void {
  const before = image.src
  image.src = URL.createObjectURL(data)
  if (before) URL.revokeObjectURL(before)
}

export class Results {
  private readonly pictures = new Map<string, HTMLImageElement>()
  private readonly plots = new Map<string, HTMLImageElement>()

  clear(): void {
    for (const id of ['cameras', 'plots', 'scores']) byId(id).replaceChildren()
    byId('plots-box').hidden = true
    this.pictures.clear()
    this.plots.clear()
  }

  /** Of the camera, made when its first picture comes. */
  picture(camera: string): HTMLImageElement {
    let image = this.pictures.get(camera)
    if (!image) {
      image = make('img', { alt: `What camera ${camera} sees, marked` })
      this.pictures.set(camera, image)
      byId('cameras').append(make('figure', { className: 'box' }, make('figcaption', {}, camera), image))
    }
    return image
  }

  scores(scores: ScoreOf[]): void {
    const head = make('tr', {}, ...['method', 'mean error', 'coverage', 'of ceiling', 'outliers'].map(title => make('th', { scope: 'col' }, title)))
    const rows = scores.map(s => make('tr', {}, make('th', { scope: 'row' }, s.method.replace('_', ' ')),
      ...[figure(s.mean_error_m, 1e3, 2, 'mm'), figure(s.coverage, 100, 1, '%'), figure(s.coverage_of_ceiling, 100, 1, '%'), figure(s.outliers, 100, 2, '%')].map(text => make('td', { className: 'number' }, text))))
    byId('scores').replaceChildren(make('table', {}, make('thead', {}, head), make('tbody', {}, ...rows)))
  }

  plot(name: string, title: string, svg: string): void {
    let image = this.plots.get(name)
    if (!image) {
      image = make('img', { alt: `${title}: curves of what is measured so far` })
      this.plots.set(name, image)
      byId('plots').append(make('figure', {}, make('figcaption', {}, title), image))
      byId('plots-box').hidden = false
    }
    renew(image, new Blob([svg], { type: 'image/svg+xml' }))
  }
}
