// The benchmark platform's page: datasets and their leaderboards, sending something, and a submission with its score.
import { ask, byId, make, shown } from './page'

interface Figures {
  f_score: number
  f_score_interval: [number, number] | null
  tolerance_m: number
  mean_error_m: number | null
  mean_error_interval_m: [number, number] | null
  coverage: number
  coverage_interval: [number, number]
  coverage_of_ceiling: number | null
  outliers: number | null
  outliers_interval: [number, number] | null
  points: number
}
interface Submission {
  id: string
  name: string
  dataset: string
  kind: string
  uses: string
  received_s: number
  state: 'queued' | 'running' | 'done' | 'failed'
  link: string
  message?: string
  before?: number
  files?: string[]
  figures?: Figures
  score?: { behind: Record<string, unknown> }
}
interface Dataset {
  name: string
  uses: string[]
  download: string
  archive_bytes: number
  [fact: string]: unknown
}
interface Platform {
  version: string
  no_algorithms: string
  waiting: number
  uploads_per_hour: number
  most_cloud_bytes: number
  most_archive_bytes: number
  datasets: Dataset[]
}

const main = byId('main')
const every = 1500 // [ms] between two looks at what has not ended

const mebibytes = (bytes: number) => `${(bytes / 2 ** 20).toPrecision(3)} MiB`
const when = (seconds: number) => new Date(1000 * seconds).toISOString().slice(0, 16).replace('T', '\u00a0').replace(/-/g, '\u2011') // stays on one line

function warn(text: string): void {
  byId('warning').hidden = text === ''
  byId('warning').textContent = text
}

// Figures with their intervals.

interface Column {
  title: string
  value: (f: Figures) => number | null
  interval: (f: Figures) => [number, number] | null
  scale: number
  unit: string
  better: 'more' | 'less'
}

const columns = (tolerance_m: number): Column[] => [
  { title: `F at ${1e3 * tolerance_m} mm`, value: f => f.f_score, interval: f => f.f_score_interval, scale: 100, unit: '%', better: 'more' },
  { title: 'Mean error', value: f => f.mean_error_m, interval: f => f.mean_error_interval_m, scale: 1e3, unit: 'mm', better: 'less' },
  { title: 'Coverage', value: f => f.coverage, interval: f => f.coverage_interval, scale: 100, unit: '%', better: 'more' },
  { title: 'Outliers', value: f => f.outliers, interval: f => f.outliers_interval, scale: 100, unit: '%', better: 'less' },
]

function figure(column: Column, figures: Figures): HTMLElement {
  const value = column.value(figures)
  if (value === null) return make('td', { className: 'number' }, 'none')
  const interval = column.interval(figures)
  const text = (v: number) => (column.scale * v).toFixed(2)
  return make('td', { className: 'number' }, `${text(value)} ${column.unit}`,
    make('small', {}, interval ? `${text(interval[0])} to ${text(interval[1])}` : 'no interval'))
}

const svg = (tag: string, attributes: Record<string, string | number>, ...children: (Element | string)[]) => {
  const made = document.createElementNS('http://www.w3.org/2000/svg', tag)
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, String(value))
  made.append(...children)
  return made
}

/** Round steps from 0 that end beyond `most`: 1, 2 or 5 of a power of ten. */
function ticks(most: number): number[] {
  const power = 10 ** Math.floor(Math.log10(most / 4))
  const step = [1, 2, 5, 10].map(k => k * power).find(s => 5 * s >= most) ?? most
  return Array.from({ length: Math.ceil(most / step) + 1 }, (_, k) => k * step)
}

/** Each submission's figure as a dot on a bar, its 95 % interval. */
function intervals(column: Column, all: Submission[]): HTMLElement {
  const some = all.filter(s => s.figures && column.value(s.figures) !== null).slice(0, 20)
  const left = 150, width = 520, row = 22, height = row * some.length + 30
  const spans = some.map(s => {
    const value = column.value(s.figures!)!
    return [value, ...(column.interval(s.figures!) ?? [value, value])].map(v => column.scale * v)
  })
  const marks = ticks(Math.max(...spans.flat(), 1e-9) * 1.05)
  const most = marks[marks.length - 1]
  const x = (v: number) => left + ((width - left - 10) * v) / most
  const picture = svg('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': `${column.title} of each submission with its 95 % interval` })
  some.forEach((s, i) => {
    const [value, low, high] = spans[i], y = row * i + 14
    const name = s.name.length > 20 ? `${s.name.slice(0, 19)}…` : s.name
    picture.append(
      svg('text', { x: left - 8, y: y + 4, 'text-anchor': 'end', class: 'label' }, name),
      svg('line', { x1: x(low), x2: Math.max(x(high), x(low) + 1), y1: y, y2: y, class: 'interval' }),
      svg('circle', { cx: x(value), cy: y, r: 4, class: 'value' }),
    )
  })
  const foot = row * some.length + 8
  picture.append(svg('line', { x1: left, x2: width - 10, y1: foot, y2: foot, class: 'axis' }))
  for (const v of marks) picture.append(svg('text', { x: x(v), y: foot + 16, 'text-anchor': v === most ? 'end' : 'middle', class: 'label' }, String(Number(v.toPrecision(3)))))
  return make('figure', {}, picture as unknown as HTMLElement, make('figcaption', {}, `${column.title} [${column.unit}], 95 % intervals; ${column.better} is better`))
}

function state(s: Submission): string {
  if (s.state === 'queued') return s.before === undefined ? 'waiting' : `waiting; ${s.before} before it`
  return { running: 'being scored', done: 'scored', failed: 'failed' }[s.state]
}

const linked = (s: Submission) => make('a', { href: s.link }, s.name)

// Sending.

function sending(platform: Platform, dataset: () => Dataset): HTMLElement {
  const kind = make('select', {}, make('option', { value: 'clouds' }, 'a cloud (.ply or .pcd)'), make('option', { value: 'algorithms' }, 'an algorithm (.tar.gz)'))
  const name = make('input', { type: 'text', maxLength: 60, required: true, placeholder: 'what the table calls it' })
  const uses = make('select', {})
  const file = make('input', { type: 'file', required: true })
  const button = make('button', { className: 'main' }, 'Send')
  const says = make('p', {})
  says.setAttribute('role', 'status')
  const progress = make('progress', { max: 1, value: 0, hidden: true })
  progress.setAttribute('aria-label', 'Sent')
  const usesLabel = make('label', {}, 'Made from ', uses)
  const form = make('form', { autocomplete: 'off' }, make('label', {}, 'What ', kind), make('label', {}, 'Name ', name), usesLabel, make('label', {}, 'File ', file), button, progress, says)
  const fit = () => {
    usesLabel.hidden = kind.value === 'algorithms'
    uses.replaceChildren(...dataset().uses.map(u => make('option', {}, u)))
    const refused = kind.value === 'algorithms' ? platform.no_algorithms : ''
    button.disabled = refused !== ''
    says.textContent = refused ? `Algorithms are refused here: ${refused}` : `At most ${mebibytes(kind.value === 'clouds' ? platform.most_cloud_bytes : platform.most_archive_bytes)}, ${platform.uploads_per_hour} an hour.`
  }
  kind.addEventListener('change', fit)
  form.addEventListener('fit', fit)
  form.addEventListener('submit', event => {
    event.preventDefault()
    const body = file.files?.[0]
    if (!body) return
    const request = new XMLHttpRequest() // which tells of its progress, unlike fetch
    const words = new URLSearchParams({ dataset: dataset().name, name: name.value, uses: uses.value })
    request.open('POST', `/api/${kind.value}?${words.toString().replace(/\+/g, '%20')}`)
    request.upload.onprogress = e => { progress.value = e.loaded / e.total }
    const over = (text: string) => {
      says.textContent = text
      progress.hidden = true
      button.disabled = false
    }
    request.onload = () => {
      if (request.status !== 202) return over(request.responseText.trim())
      location.assign((JSON.parse(request.responseText) as Submission).link)
    }
    request.onerror = () => over('The connection was lost before all was sent.')
    progress.hidden = false
    button.disabled = true
    request.send(body)
  })
  fit()
  return make('div', { className: 'box' }, make('h2', {}, 'Send'), form)
}

// Pages.

async function front(): Promise<void> {
  const platform = (await ask('platform')) as Platform
  const asked = new URLSearchParams(location.search).get('dataset')
  let chosen = platform.datasets.find(d => d.name === asked) ?? platform.datasets[0]
  const choice = make('select', { id: 'dataset' }, ...platform.datasets.map(d => make('option', { selected: d === chosen }, d.name)))
  const about = make('div', { className: 'facts' }), table = make('div', { className: 'scroll' }), plots = make('div', { className: 'plots' }), newest = make('div', { className: 'scroll' })
  const download = make('a', {})
  const form = sending(platform, () => chosen)
  let sorted = 0

  const show = async () => {
    const board = (await ask(`datasets/${encodeURIComponent(chosen.name)}`)) as { best: Submission[]; newest: Submission[] }
    const { name, uses, download: address, archive_bytes, ...facts } = chosen
    about.replaceChildren(shown({ ...Object.fromEntries(Object.entries(facts).filter(([, value]) => value !== '')), pictures_for: uses }))
    download.href = address
    download.textContent = `Download ${name} (${mebibytes(archive_bytes)})`
    const all = columns(board.best[0]?.figures?.tolerance_m ?? 0.002)
    const by = all[sorted]
    const worst = by.better === 'more' ? -Infinity : Infinity
    const value = (s: Submission) => (s.figures && by.value(s.figures)) ?? worst
    const best = [...board.best].sort((a, b) => (by.better === 'more' ? value(b) - value(a) : value(a) - value(b)) || 0)
    const heads = all.map((column, i) => {
      const button = make('button', { type: 'button', title: `Sort by ${column.title}`, onclick: () => { sorted = i; void show() } }, column.title)
      const th = make('th', {}, button)
      if (i === sorted) th.setAttribute('aria-sort', column.better === 'more' ? 'descending' : 'ascending')
      return th
    })
    const rows = best.map((s, i) => make('tr', {}, make('td', {}, String(i + 1)), make('td', {}, linked(s), make('small', {}, `${s.kind}, ${s.uses}, ${when(s.received_s)}`)),
      ...all.map(column => figure(column, s.figures!)), make('td', { className: 'number' }, String(s.figures!.points))))
    table.replaceChildren(rows.length === 0 ? make('p', {}, 'Nothing has been scored yet.') : make('table', { id: 'leaderboard' },
      make('thead', {}, make('tr', {}, make('th', {}, 'Rank'), make('th', {}, 'Submission'), ...heads, make('th', {}, 'Points'))), make('tbody', {}, ...rows)))
    plots.replaceChildren(...(rows.length === 0 ? [] : [intervals(by, best), ...(sorted === 1 ? [] : [intervals(all[1], best)])]))
    newest.replaceChildren(make('table', { id: 'newest' }, make('tbody', {}, ...board.newest.map(s =>
      make('tr', {}, make('td', {}, when(s.received_s)), make('td', {}, linked(s)), make('td', {}, s.kind), make('td', {}, s.message ? `failed: ${s.message}` : state(s)))))))
    form.querySelector('form')!.dispatchEvent(new Event('fit'))
    const going = board.newest.some(s => s.state === 'queued' || s.state === 'running')
    byId('connection').textContent = `version ${platform.version}`
    clearTimeout(again)
    again = going ? setTimeout(() => void show().catch(lost), 2 * every) : undefined
  }
  let again: ReturnType<typeof setTimeout> | undefined
  choice.addEventListener('change', () => {
    chosen = platform.datasets[choice.selectedIndex]
    history.replaceState(null, '', `/?dataset=${encodeURIComponent(chosen.name)}`)
    void show().catch(lost)
  })
  main.replaceChildren(make('div', { id: 'run' },
    make('div', {}, make('div', { className: 'box' }, make('h2', {}, 'Dataset'), make('label', {}, 'Choose ', choice), about, make('p', {}, download)), form),
    make('div', {}, make('div', { className: 'box' }, make('h2', {}, 'Leaderboard'), table, plots), make('div', { className: 'box' }, make('h2', {}, 'Newest'), newest))))
  await show()
}

async function one(id: string): Promise<void> {
  const s = (await ask(`submissions/${id}`)) as Submission
  document.title = `${s.name}: tankrig benchmark`
  const going = s.state === 'queued' || s.state === 'running'
  const says = make('p', { id: 'state' }, s.message ? `failed: ${s.message}` : going ? `${state(s)}; this page will show the score` : state(s))
  says.setAttribute('role', 'status')
  const box = make('div', { className: 'box' }, make('h2', {}, s.name),
    make('p', {}, `${s.kind} on `, make('a', { href: `/?dataset=${encodeURIComponent(s.dataset)}` }, s.dataset), `, ${s.uses}, sent ${when(s.received_s)} UTC`), says)
  const parts: HTMLElement[] = [box]
  if (s.figures) {
    const all = columns(s.figures.tolerance_m)
    box.append(make('div', { className: 'scroll' }, make('table', { id: 'figures' }, make('thead', {}, make('tr', {}, ...all.map(c => make('th', {}, c.title)), make('th', {}, 'Points'))),
      make('tbody', {}, make('tr', {}, ...all.map(c => figure(c, s.figures!)), make('td', { className: 'number' }, String(s.figures.points)))))))
    const report = make('iframe', { src: `/files/${s.id}/report.html`, title: 'Plots, clouds in 3D and all figures' })
    parts.push(make('div', { className: 'box' }, make('h2', {}, 'Report'), report))
  }
  const files = make('ul', {}, ...(s.files ?? []).map(f => make('li', {}, make('a', { href: f, download: '' }, f.split('/').pop()!))))
  parts.push(make('div', { className: 'box' }, make('h2', {}, s.figures ? 'Behind the figures' : 'Files'), make('div', { className: 'facts' }, s.score ? shown(s.score.behind) : ''), files,
    make('p', {}, 'As JSON: ', make('a', { href: `/api/submissions/${s.id}` }, `/api/submissions/${s.id}`))))
  main.replaceChildren(...parts)
  if (going) setTimeout(() => void one(id).catch(lost), every)
}

function lost(problem: unknown): void {
  warn(`What is shown may be old: ${problem instanceof Error ? problem.message : String(problem)}`)
}

const id = /^\/submissions\/([0-9a-z]+)$/.exec(location.pathname)?.[1]
void (id ? one(id) : front()).catch(lost)
