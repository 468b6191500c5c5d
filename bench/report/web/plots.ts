// The curves of a report with the value under the pointer, switched on and off by their legend, in place of the static
// ones. A click on a dot leads to what stands behind it. Reads what chart_json() of bench/sweep/chart.hpp writes into the
// page, and loads nothing.
import uPlot from 'uplot'
import style from 'uplot/dist/uPlot.min.css'

interface Dot {
  x: number
  y: number
  interval: [number, number] | null
  link: string | null // into the page
}

interface Curve {
  name: string
  colour: string
  dots: Dot[] // by rising x
}

interface Panel {
  title: string
  x_label: string
  y_label: string
  curves: Curve[]
}

interface Chart {
  x: [number, number] // axes, the same for all panels
  y: [number, number]
  panels: Panel[]
}

const height = 320 // of a panel [CSS px]
const reach = 20 // of a click around a dot [CSS px]
const digits = (number: number) => String(+number.toPrecision(4))

function valueOf(dot: Dot | undefined): string {
  if (!dot) return '--'
  const { y, interval } = dot
  return digits(y) + (interval ? ` (${digits(interval[0])} to ${digits(interval[1])})` : '')
}

/** The intervals of a curve: a bar at each dot, a band between them. */
function drawIntervals(plot: uPlot, curve: Curve): void {
  const { ctx } = plot
  const known = curve.dots.filter(dot => dot.interval)
  const at = (x: number, y: number): [number, number] => [plot.valToPos(x, 'x', true), plot.valToPos(y, 'y', true)]
  const area = new Path2D()
  area.rect(plot.bbox.left, plot.bbox.top, plot.bbox.width, plot.bbox.height)
  ctx.save()
  ctx.clip(area)
  ctx.strokeStyle = ctx.fillStyle = curve.colour
  ctx.globalAlpha = 0.6
  ctx.lineWidth = window.devicePixelRatio
  ctx.beginPath()
  for (const { x, interval } of known) {
    ctx.moveTo(...at(x, interval![0]))
    ctx.lineTo(...at(x, interval![1]))
  }
  ctx.stroke()
  ctx.globalAlpha = 0.12
  ctx.beginPath()
  for (const { x, interval } of known) ctx.lineTo(...at(x, interval![0]))
  for (const { x, interval } of known.reverse()) ctx.lineTo(...at(x, interval![1]))
  ctx.fill()
  ctx.restore()
}

/** The nearest dot of a curve that is shown. */
function dotAt(plot: uPlot, panel: Panel, left: number, top: number): Dot | undefined {
  let best: Dot | undefined
  let least = reach
  panel.curves.forEach((curve, i) => {
    if (!plot.series[i + 1].show) return
    for (const dot of curve.dots) {
      const distance = Math.hypot(plot.valToPos(dot.x, 'x') - left, plot.valToPos(dot.y, 'y') - top)
      if (distance < least) {
        least = distance
        best = dot
      }
    }
  })
  return best
}

function draw(place: HTMLElement, chart: Chart, panel: Panel, key: string): void {
  const xs = [...new Set(panel.curves.flatMap(curve => curve.dots.map(dot => dot.x)))].sort((a, b) => a - b)
  const byX = panel.curves.map(curve => new Map(curve.dots.map(dot => [dot.x, dot])))
  const fixed = ([min, max]: [number, number]) => ({
    auto: false,
    min,
    max,
    range: (_: uPlot, from: number | null, to: number | null): uPlot.Range.MinMax => [from ?? min, to ?? max],
  })
  const plot = new uPlot(
    {
      title: panel.title,
      width: place.clientWidth,
      height,
      scales: { x: { time: false, ...fixed(chart.x) }, y: fixed(chart.y) },
      axes: [{ label: panel.x_label }, { label: panel.y_label }],
      cursor: { focus: { prox: 1.5 * reach }, sync: { key } },
      focus: { alpha: 0.25 },
      series: [
        { label: panel.x_label, value: (_, x) => (x === null ? '--' : digits(x)) },
        ...panel.curves.map((curve, i) => ({
          label: curve.name,
          stroke: curve.colour,
          width: 1.5,
          points: { show: true, size: 6, fill: curve.colour },
          spanGaps: true,
          value: (_: uPlot, __: number, ___: number, index: number | null) =>
            index === null ? '--' : valueOf(byX[i].get(xs[index])),
        })),
      ],
      hooks: {
        drawSeries: [(u, i) => { if (i > 0 && u.series[i].show) drawIntervals(u, panel.curves[i - 1]) }],
      },
    },
    [xs, ...byX.map(dots => xs.map(x => dots.get(x)?.y ?? null))],
    place,
  )
  plot.over.addEventListener('mousemove', event => {
    plot.over.style.cursor = dotAt(plot, panel, event.offsetX, event.offsetY)?.link ? 'pointer' : ''
  })
  plot.over.addEventListener('click', event => {
    const link = dotAt(plot, panel, event.offsetX, event.offsetY)?.link
    if (!link) return
    location.hash = link
    document.getElementById(link.slice(1))?.scrollIntoView()
  })
  new ResizeObserver(() => plot.setSize({ width: place.clientWidth, height })).observe(place)
}

const sheet = document.createElement('style')
sheet.textContent = style
document.head.append(sheet)
document.querySelectorAll<HTMLElement>('figure.chart').forEach((figure, number) => {
  const data = figure.querySelector('script')?.textContent
  const still = figure.querySelector('svg')
  if (!data || !still) return
  const chart = JSON.parse(data) as Chart
  const panels = document.createElement('div')
  panels.className = 'panels'
  still.replaceWith(panels)
  try {
    for (const panel of chart.panels) {
      const place = document.createElement('div')
      panels.append(place)
      draw(place, chart, panel, String(number))
    }
  } catch {
    panels.replaceWith(still)
  }
})
