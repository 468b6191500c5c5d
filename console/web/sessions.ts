// The list of sessions, and one of them: its report, its frames in time, its files.
import { csvOf } from './ply'
import { ask, byId, degrees, make } from './page'
import { reportFrame } from './report'

interface Listed {
  session: string
  path?: string
  [key: string]: unknown
}

interface Frame {
  camera: string
  file: string
  time: number // [s] after the first
  joints: string
}

const folderOf = (s: Listed) => String(s.path ?? s.session).split('/').filter(part => part).pop() ?? ''
const at = (folder: string, file: string) => `/sessions/${encodeURIComponent(folder)}/${file.split('/').map(encodeURIComponent).join('/')}`

/** frames.csv: a name for each column in its first line. */
function framesOf(csv: string): Frame[] {
  const [head, ...lines] = csv.trim().split('\n').filter(line => !line.startsWith('#'))
  const names = head.split(',')
  const column = (part: string) => names.findIndex(name => name.includes(part))
  const [camera, file, stamp] = [column('camera'), column('file'), column('stamp')]
  const joints = names.flatMap((name, i) => { const joint = /^q_(.*)_rad$/.exec(name)?.[1]; return joint ? [{ name: joint.replace('_', ' '), i }] : [] })
  let begin = 0n
  return lines.map((line, i) => {
    const cells = line.split(',')
    const ns = BigInt(cells[stamp])
    if (i === 0) begin = ns
    const angles = joints.filter(j => cells[j.i]).map(j => `${j.name} ${degrees((Number(cells[j.i]) * 180) / Math.PI)}`)
    return { camera: cells[camera], file: cells[file], time: Number(ns - begin) / 1e9, joints: angles.join(', ') }
  })
}

/** The frames of one camera along a time line. */
async function timeLine(folder: string): Promise<HTMLElement> {
  const answer = await fetch(at(folder, 'frames.csv'))
  if (!answer.ok) return make('p', {}, 'This session has no frames.csv.')
  const all = framesOf(await answer.text())
  const cameras = [...new Set(all.map(f => f.camera))]
  const choice = make('select', {}, ...cameras.map(c => make('option', { value: c }, c)))
  const slider = make('input', { type: 'range', min: '0', value: '0' })
  slider.setAttribute('aria-label', 'Frame')
  const picture = make('img', { alt: 'The frame' })
  const says = make('p')
  const show = () => {
    const frames = all.filter(f => f.camera === choice.value)
    slider.max = String(frames.length - 1)
    const frame = frames[Math.min(Number(slider.value), frames.length - 1)]
    if (!frame) return
    picture.src = at(folder, frame.file)
    says.textContent = `frame ${Number(slider.value) + 1} of ${frames.length}, ${frame.time.toFixed(3)} s; ${frame.joints || 'no joints'}`
  }
  choice.addEventListener('change', show)
  slider.addEventListener('input', show)
  show()
  return make('div', { className: 'frames' }, make('label', {}, 'Camera ', choice), slider, picture, says)
}

function save(href: string, name: string): void {
  make('a', { href, download: name }).click()
}

/** The browser keeps what comes as a file; the server's words, where there is none, come into a frame of their own. */
function download(href: string, says: HTMLElement): void {
  const frame = make('iframe', { hidden: true, src: href, title: 'Download' })
  frame.addEventListener('load', () => {
    const words = frame.contentDocument?.body?.textContent?.trim()
    if (frame.contentDocument?.location.href !== 'about:blank') says.textContent = words || 'The server refused it.'
  })
  says.replaceChildren('Asked for: the browser keeps it as a file. A bag takes a while.', frame)
}

/** A cloud as a table: every property that the PLY has. */
async function downloadCsv(folder: string, method: string, place: HTMLElement): Promise<void> {
  const answer = await fetch(at(folder, `clouds/${method}.ply`))
  if (!answer.ok) return place.append(` This session has no cloud of ${method}.`)
  const url = URL.createObjectURL(new Blob(csvOf(await answer.arrayBuffer()), { type: 'text/csv' }))
  save(url, `${folder}-${method}.csv`)
  setTimeout(() => URL.revokeObjectURL(url), 60_000)
}

/** Starts a command of the forms. */
type Begin = (command: string, given: Record<string, string>) => void
type ShowCloud = (session: string, method: string) => void

async function open(folder: string, place: HTMLElement, begin: Begin, showCloud: ShowCloud): Promise<void> {
  const files = ['session.yaml', 'rig.yaml', 'joints.csv', 'frames.csv', 'events.csv', 'clouds/laser.ply', 'clouds/stereo.ply', 'report.html']
  const links = files.map(file => make('a', { href: at(folder, file), target: '_blank', rel: 'noopener' }, file))
  const line = make('p', {}, 'Files: ')
  for (const link of links) line.append(link, ' ')
  const wishes = make('div', { className: 'row' })
  for (const [command, title] of [['check', 'Check'], ['recover', 'Recover'], ['report', 'Reconstruct anew']]) {
    const button = make('button', { type: 'button' }, title)
    button.addEventListener('click', () => begin(command, { session: folder }))
    wishes.append(button)
  }
  for (const method of ['laser', 'stereo', 'laser_paper', 'stereo_paper']) {
    const button = make('button', { type: 'button' }, `Show ${method}`)
    button.addEventListener('click', () => showCloud(folder, method))
    wishes.append(button)
  }
  const downloads = make('div', { className: 'row' }, 'Download ')
  const said = make('p', { role: 'status' })
  for (const method of ['laser', 'stereo']) {
    downloads.append(make('a', { className: 'button', href: at(folder, `clouds/${method}.ply`), download: `${folder}-${method}.ply` }, `${method} as PLY`))
    const button = make('button', { type: 'button' }, `${method} as CSV`)
    button.addEventListener('click', () => void downloadCsv(folder, method, downloads))
    downloads.append(button)
  }
  for (const [kind, title] of [['zip', 'all as zip'], ['bag', 'all as ROS bag']]) {
    const button = make('button', { type: 'button' }, title)
    button.addEventListener('click', () => download(`/downloads/${encodeURIComponent(folder)}.${kind}`, said))
    downloads.append(button)
  }
  const report = reportFrame(at(folder, 'report.html'), `Report of ${folder}`)
  const reported = await fetch(report.src)
  void reported.body?.cancel()
  place.replaceChildren(
    make('div', { className: 'box' }, make('h2', {}, folder), line, wishes, downloads, said),
    make('div', { className: 'box' }, make('h2', {}, 'Report'), reported.ok ? report : 'There is none: the scan was not reconstructed. "Reconstruct anew" makes one.'),
    make('div', { className: 'box' }, make('h2', {}, 'Frames'), await timeLine(folder)),
  )
  place.scrollIntoView({ block: 'start' })
}

const shownAs: Record<string, (value: unknown) => string> = {
  created_utc: value => String(value).replace('T', ' ').replace('Z', ''),
  lux_before: value => Number(value).toPrecision(3),
}
const columns = ['session', 'status', 'created_utc', 'rig', 'lux_before', 'operator', 'frames']

/** One word of a search: "lux>100" and "lux<200" compare, any other is to be found somewhere in what is known. */
function fits(s: Listed, word: string): boolean {
  const [, sign, limit] = /^lux([<>])([\d.]+)$/.exec(word) ?? []
  if (!sign) return JSON.stringify(s).toLowerCase().includes(word)
  const lux = Number(s.lux_before ?? s.lux_after ?? NaN)
  return sign === '<' ? lux < Number(limit) : lux > Number(limit)
}

/** `newest`: is opened at once. */
export async function showSessions(begin: Begin, showCloud: ShowCloud, newest = false): Promise<void> {
  const view = byId('sessions')
  const filter = make('input', { type: 'search', placeholder: 'rig, date, operator, status, lux>100' })
  const place = make('div')
  const body = make('tbody')
  const says = make('p')
  const table = make('table', {}, make('thead', {}, make('tr', {}, ...columns.map(c => make('th', {}, c.replace(/_/g, ' '))))), body)
  const again = make('button', { type: 'button' }, 'Refresh')
  again.addEventListener('click', () => void showSessions(begin, showCloud))
  view.replaceChildren(
    make('div', { className: 'box' }, make('div', { className: 'row' }, make('label', {}, 'Find ', filter), again), says, make('div', { className: 'scroll' }, table)),
    place,
  )
  let all: Listed[]
  try {
    all = (await ask('sessions')) as Listed[]
  } catch (error) {
    says.textContent = error instanceof Error ? error.message : String(error)
    return
  }
  const show = () => {
    const wanted = filter.value.toLowerCase().split(/\s+/).filter(w => w)
    const found = all.filter(s => wanted.every(word => fits(s, word))).reverse() // the newest first
    says.textContent = all.length === 0 ? 'There are no sessions yet.' : `${found.length} of ${all.length} sessions`
    body.replaceChildren(
      ...found.map(s => {
        const button = make('button', { type: 'button' }, folderOf(s))
        const row = make('tr', {}, make('td', {}, button), ...columns.slice(1).map(c => make('td', {}, s[c] === undefined || s[c] === null ? '' : (shownAs[c] ?? String)(s[c]))))
        button.addEventListener('click', () => {
          for (const other of body.rows) other.classList.toggle('chosen', other === row)
          void open(folderOf(s), place, begin, showCloud)
        })
        return row
      }),
    )
  }
  filter.addEventListener('input', show)
  show()
  if (newest) body.querySelector('button')?.click()
}
