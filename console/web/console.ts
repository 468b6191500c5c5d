// The operator's console: what the server says is shown, what the operator wants is asked for. docs/reference/console.md
// describes the messages.
import { Cloud, SceneMessage } from './cloud'
import { Compare } from './compare'
import { Corners, ToClick } from './corners'
import { ask, byId, make, shown, Terminal } from './page'
import { showSessions } from './sessions'

interface Field {
  key: string
  label: string
  kind: 'text' | 'number' | 'choice' | 'word' | 'folder'
  choices: string[]
  help: string
  required: boolean
}
interface Form {
  name: string
  title: string
  what: string
  hold: boolean
  moves: boolean
  fields: Field[]
}
interface Hello {
  is: 'hello'
  page: string
  you: number
  user: string
  role: 'watch' | 'operate' | 'administer'
  rig: { name: string; description: string; version: string; calibration: string; warnings: string[]; click: ToClick | null }
  forms: Form[]
}
interface Run {
  is: 'run'
  command: string
  title: string
  words: string[]
  moves: boolean
  hold: boolean
  stopping: boolean
  began_utc: string
  exit_code: number | null
}
interface Feed {
  is: 'feed'
  feed: string
  [key: string]: unknown
}
type Message =
  | Hello
  | Run
  | Feed
  | { is: 'control'; holder: number | null; holder_name: string; offered: boolean; browsers: number }
  | { is: 'log'; text: string }
  | { is: 'refused'; why: string }
  | { is: 'granted'; wish: string; answer: { file: string } }
  | { is: 'alive'; utc: string }

const old = 1000 // [ms] without a sign of life
const holdEvery = 100 // [ms]; the server lets go after 400

const log = byId<HTMLPreElement>('log')
const terminal = new Terminal()
const cloud = new Cloud(byId('cloud'))
const pictures = new Map<string, HTMLImageElement>()
let socket: WebSocket | undefined
let you = 0
let watches = false // has no role that may take control
let forms: Form[] = []
let toClick: ToClick | null = null
let corners: Corners | undefined
let compare: Compare | undefined
let run: Run | undefined
let holder: number | null = null
let offered = false
let heard = 0
let stopPressed = 0

const say = (id: string, text: string, kind = '') => {
  const place = byId(id)
  place.textContent = text
  place.className = `${place.classList.contains('live') ? 'live ' : ''}${kind}`
}
const warn = (text: string) => {
  byId('warning').textContent = text
  byId('warning').hidden = text === ''
}
const tell = (message: { do: string; [key: string]: unknown }) => {
  if (document.body.classList.contains('outdated') && message.do !== 'stop') return
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message))
}
const runs = () => run !== undefined && run.exit_code === null

// Connection.

function connect(): void {
  socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/live`)
  socket.binaryType = 'arraybuffer'
  socket.addEventListener('message', event => {
    heard = Date.now()
    if (typeof event.data === 'string') take(JSON.parse(event.data) as Message)
    else takeBinary(event.data as ArrayBuffer)
  })
  socket.addEventListener('close', () => {
    holder = null
    showControl()
    void explainRefusal()
    setTimeout(connect, 1000)
  })
}

/** A server that was started anew knows nobody who was let in before. */
async function explainRefusal(): Promise<void> {
  const { status } = await fetch('/live').catch(() => ({ status: 0 }))
  const nothing = 'Nothing on this page works until then, STOP included.'
  if (status === 401) outdated(`You are logged out: the time is over, or the server was started anew. Log in again. ${nothing}`)
  if (status === 403) outdated(`The server was started anew and does not know this page: open the address that it has printed. ${nothing}`)
}

function outdated(why: string): void {
  document.body.classList.add('outdated')
  byId('outdated').hidden = false
  const says = byId('outdated').querySelector('p')
  if (says) says.textContent = why
  showControl()
}

/** A page of yesterday is loaded anew; one that stays yesterday's says so, and its operator decides. */
function checkVersion(server: string): void {
  const own = document.querySelector<HTMLMetaElement>('meta[name=version]')?.content
  document.body.classList.toggle('outdated', own !== server)
  byId('outdated').hidden = own === server
  if (own === server) return sessionStorage.removeItem('loaded for')
  outdated(`This page is of another version (${own}) than the server (${server}). Until it is loaded anew, only STOP works here.`)
  if (sessionStorage.getItem('loaded for') === server) return
  sessionStorage.setItem('loaded for', server)
  location.reload()
}
byId('outdated').querySelector('button')?.addEventListener('click', () => location.reload())

setInterval(() => {
  const age = Date.now() - heard
  const lost = heard === 0 || age > old
  document.body.classList.toggle('stale', lost)
  byId('connection').textContent = !lost ? 'connected' : heard === 0 ? 'connecting' : `connection lost: what is shown is ${(age / 1000).toFixed(0)} s old`
  byId('connection').className = lost ? 'bad' : ''
}, 200)

// What the server says.

function take(message: Message): void {
  switch (message.is) {
    case 'hello':
      checkVersion(message.page)
      you = message.you
      forms = message.forms
      watches = message.role === 'watch'
      byId('leave').hidden = message.user === ''
      byId('leave').title = `${message.user} may ${message.role}`
      toClick = message.rig.click
      byId('rig').textContent = message.rig.name
      byId('rig').title = `${message.rig.description} (tankrig ${message.rig.version})`
      document.title = `${message.rig.name} - tankrig console`
      say('calibration', message.rig.calibration, message.rig.warnings.length > 0 ? 'bad' : '')
      byId('calibration').title = message.rig.warnings.join('; ')
      if (byId<HTMLSelectElement>('command').length === 0) chooseForms()
      forget()
      break
    case 'control':
      holder = message.holder
      offered = message.offered
      say('control', holder === null ? `nobody's` : holder === you ? 'yours' : `${message.holder_name || `browser ${holder}`}'s`, holder === you ? 'good' : '')
      byId('control').title = `${message.browsers} browsers look on`
      showControl()
      break
    case 'run':
      if (run?.began_utc !== message.began_utc || run.command !== message.command) forget()
      run = message
      showRun()
      break
    case 'log': {
      const follows = log.scrollTop + log.clientHeight >= log.scrollHeight - 20
      log.textContent = terminal.add(message.text)
      if (follows) log.scrollTop = log.scrollHeight
      break
    }
    case 'feed':
      fed(message)
      break
    case 'refused':
      warn(message.why)
      break
    case 'granted':
      corners?.saved(message.answer.file)
      break
    case 'alive':
      break
  }
}

/** A new run has nothing of the last one. */
function forget(): void {
  run = undefined
  document.body.classList.remove('running')
  terminal.clear()
  log.textContent = ''
  cloud.clear()
  for (const id of ['stage', 'end', 'cloud-says']) say(id, '')
  byId('joints').replaceChildren()
  byId('cameras').replaceChildren()
  pictures.clear()
  byId<HTMLProgressElement>('progress').value = 0
  say('laser', '--')
  say('arm', '--')
  say('run-state', 'nothing runs')
  warn('')
}

function fed(message: Feed): void {
  switch (message.feed) {
    case 'progress':
      byId<HTMLProgressElement>('progress').value = Number(message.fraction)
      say('stage', `${message.stage}  ${(100 * Number(message.fraction)).toFixed(0)} %  ${message.detail}`)
      break
    case 'state':
      if (Array.isArray(message.arm)) cloud.setArm(message.arm as number[][])
      if (message.laser) say('laser', String(message.laser), message.laser === 'on' ? 'lit' : '')
      say('arm', String(message.segment))
      if (typeof message.joints_deg === 'object' && message.joints_deg !== null)
        byId('joints').replaceChildren(
          ...Object.entries(message.joints_deg).map(([name, deg]) =>
            make('tr', {}, make('th', { scope: 'row' }, name), make('td', { className: 'number' }, `${(Math.round(100 * Number(deg)) / 100 + 0).toFixed(2)}°`)),
          ),
        )
      break
    case 'scene':
      cloud.clear()
      cloud.setScene(message as unknown as SceneMessage)
      break
    case 'told':
      if (message.level === 'warning') warn(String(message.text))
      break
    case 'end': {
      const dark = message.laser_dark === true
      const rests = message.arm_at_rest === true
      const after = stopPressed > 0 && run?.stopping ? ` (${Date.now() - stopPressed} ms after STOP)` : ''
      say('laser', dark ? 'off, confirmed' : 'NOT CONFIRMED OFF', dark ? 'good' : 'bad')
      say('arm', rests ? 'at rest, confirmed' : 'NOT CONFIRMED AT REST', rests ? 'good' : 'bad')
      say('end', `Laser ${dark ? 'off' : 'not confirmed off: cut its supply'}, arm ${rests ? 'at rest' : 'not confirmed at rest: cut its power'}${after}`, dark && rests ? 'good' : 'bad')
      break
    }
  }
}

function takeBinary(data: ArrayBuffer): void {
  const bytes = new Uint8Array(data)
  const kind = String.fromCharCode(bytes[0])
  if (kind === 'L') {
    cloud.add(new Float32Array(data.slice(1)))
    say('cloud-says', `${cloud.count} points as they are found; particles are still among them`)
  } else if (kind === 'P') {
    const name = new TextDecoder().decode(bytes.subarray(2, 2 + bytes[1]))
    showPicture(name, bytes.subarray(2 + bytes[1]))
  }
}

function showPicture(name: string, jpeg: Uint8Array): void {
  let image = pictures.get(name)
  if (!image) {
    image = make('img', { alt: `What camera ${name} sees, marked` })
    pictures.set(name, image)
    byId('cameras').append(make('figure', { className: 'box' }, make('figcaption', {}, name), image))
  }
  const before = image.src
  image.src = URL.createObjectURL(new Blob([jpeg.slice()], { type: 'image/jpeg' }))
  if (before) URL.revokeObjectURL(before)
}

// Control and the run.

function showControl(): void {
  const yours = holder === you && socket?.readyState === WebSocket.OPEN && !document.body.classList.contains('outdated')
  const button = byId<HTMLButtonElement>('take')
  button.textContent = yours ? (offered ? 'Offered: another browser may take it' : 'Offer control') : 'Take control'
  button.disabled = document.body.classList.contains('outdated') || watches || (!yours && holder !== null && !offered)
  button.title = watches ? 'You may look, and press STOP.' : button.disabled ? 'Another browser is in control; it can offer control.' : ''
  for (const id of ['begin', 'answer-form'])
    for (const part of byId(id).querySelectorAll<HTMLButtonElement | HTMLInputElement>('button, input')) part.disabled = !yours || (id === 'begin' ? runs() && !run?.hold : !runs())
}

function showRun(): void {
  if (!run) return
  const over = run.exit_code !== null
  const how = !over ? (run.stopping ? 'is being stopped' : 'runs') : run.exit_code === 0 ? 'done' : run.exit_code === 3 ? 'ended in part' : `failed (exit code ${run.exit_code})`
  say('run-state', `${run.title}: ${how}`, over && run.exit_code !== 0 ? 'bad' : '')
  byId('run-title').textContent = `${run.title}: ${how}`
  byId('run-title').title = `tankrig ${run.words.join(' ')}`
  document.body.classList.toggle('running', !over && !run.hold)
  if (over) letGo()
  showControl()
}

function stop(): void {
  if (!runs() || !run?.stopping) stopPressed = Date.now()
  say('end', 'STOP is on its way; wait for the devices to confirm.')
  tell({ do: 'stop' })
  letGo()
}

byId('stop').addEventListener('pointerdown', stop)
byId('stop').addEventListener('click', event => {
  if (event.detail === 0) stop() // the keyboard's, or a reader's: no pointer came before it
})
const types = (target: EventTarget | null) =>
  target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement || (target instanceof HTMLInputElement && target.type !== 'checkbox' && target.type !== 'range')
document.addEventListener(
  'keydown',
  event => {
    if (event.key !== ' ' || types(event.target)) return
    event.preventDefault()
    if (!event.repeat) stop()
  },
  true,
)
document.addEventListener('keyup', event => { if (event.key === ' ' && !types(event.target)) event.preventDefault() }, true)

byId('leave').addEventListener('click', () => {
  void fetch('/logout', { method: 'POST' }).then(() => location.reload())
})
byId('take').addEventListener('click', () => tell({ do: holder === you ? 'offer' : 'take' }))

// The form.

function chooseForms(): void {
  const command = byId<HTMLSelectElement>('command')
  command.replaceChildren(...forms.map(form => make('option', { value: form.name }, form.title)))
  command.addEventListener('change', showForm)
  showForm()
}

/** A wish of another view: its form is filled in and started. */
function begin(command: string, given: Record<string, string>): void {
  if (!forms.some(form => form.name === command)) return warn('Your role does not include this.')
  byId<HTMLSelectElement>('command').value = command
  showForm()
  for (const [key, value] of Object.entries(given)) {
    const input = byId<HTMLFormElement>('form').elements.namedItem(key)
    if (input instanceof HTMLInputElement || input instanceof HTMLSelectElement) input.value = value
  }
  document.querySelector<HTMLButtonElement>('[data-view=run]')?.click()
  const form = chosen()
  if (form) start(form)
}

const chosen = () => forms.find(form => form.name === byId<HTMLSelectElement>('command').value)

function fieldOf(field: Field): HTMLElement {
  const name = field.key
  const list = field.choices.length > 0
  const label = (value: string) => value.split('/').pop() ?? value
  const input = list
    ? make('select', { name }, ...(field.required ? [] : [make('option', { value: '' }, 'as the rig file says')]), ...field.choices.map(c => make('option', { value: c }, label(c))))
    : make('input', { name, type: field.kind === 'text' || field.kind === 'folder' ? 'text' : 'number', required: field.required })
  if (input instanceof HTMLInputElement && input.type === 'number') input.step = 'any'
  return make('label', {}, field.label, ' ', input, ...(field.help ? [make('small', {}, field.help)] : []))
}

function showForm(): void {
  const form = chosen()
  if (!form) return
  byId('what-it-does').textContent = form.what
  byId('form').replaceChildren(...form.fields.map(fieldOf))
  const begin = make('button', { type: 'button', className: 'main', id: 'start' }, form.hold ? `Hold to ${form.title.toLowerCase()}` : `Start: ${form.title}`)
  if (form.hold) {
    begin.addEventListener('pointerdown', () => hold(form))
    for (const end of ['pointerup', 'pointerleave', 'pointercancel', 'blur']) begin.addEventListener(end, letGo)
    begin.addEventListener('keydown', event => { if (event.key === 'Enter' && !event.repeat) hold(form) })
    begin.addEventListener('keyup', event => { if (event.key === 'Enter') letGo() })
    begin.addEventListener('contextmenu', event => event.preventDefault())
  } else begin.addEventListener('click', () => start(form))
  byId('begin').replaceChildren(begin)
  showControl()
}

/** Nothing where a field is wrong; the browser shows which. */
function options(form: Form): Record<string, unknown> | undefined {
  const page = byId<HTMLFormElement>('form')
  if (!page.reportValidity()) return undefined
  const out: Record<string, unknown> = {}
  for (const field of form.fields) {
    const input = page.elements.namedItem(field.key)
    if ((input instanceof HTMLInputElement || input instanceof HTMLSelectElement) && input.value !== '')
      out[field.key] = input.type === 'number' ? Number(input.value) : input.value
  }
  return out
}

function start(form: Form): void {
  const given = options(form)
  if (!given) return
  warn('')
  tell({ do: 'start', command: form.name, options: given })
}

let holding: number | undefined

/** The first press starts the command; it asks, where it must, before a second one moves the arm. */
function hold(form: Form): void {
  if (!runs()) start(form)
  letGo()
  holding = window.setInterval(() => tell({ do: 'hold' }), holdEvery)
  tell({ do: 'hold' })
}

function letGo(): void {
  window.clearInterval(holding)
  holding = undefined
}

byId('answer-form').addEventListener('submit', event => {
  event.preventDefault()
  const input = byId<HTMLInputElement>('answer')
  tell({ do: 'answer', text: input.value })
  input.value = ''
})
for (const button of byId('answer-form').querySelectorAll<HTMLButtonElement>('[data-answer]'))
  button.addEventListener('click', () => tell({ do: 'answer', text: button.dataset.answer }))

// Views.

function showCloud(session: string, method: string): void {
  document.querySelector<HTMLButtonElement>('[data-view=compare]')?.click()
  void compare?.add(session, method)
}

function showCorners(): void {
  if (!toClick) byId('corners').replaceChildren(make('p', {}, 'This rig has no mono camera, or no mesh of its object.'))
  else
    corners ??= new Corners(
      toClick,
      `calibration-${byId('rig').textContent}`,
      (folder, clicks) => tell({ do: 'corners', folder, corners: clicks }),
      () => begin('calibrate', {}),
    )
}

async function showRig(): Promise<void> {
  const view = byId('rig-view')
  const place = make('div', { className: 'box' })
  const questions: [string, string][] = [
    ['doctor', 'What this machine and rig can do'],
    ['arm', 'Read the arm'],
    ['plan', 'The scan that is planned'],
  ]
  const buttons = questions.map(([question, title]) => {
    const button = make('button', { type: 'button' }, title)
    button.addEventListener('click', () => {
      place.replaceChildren(make('p', {}, 'asking'))
      ask(question).then(
        answer => place.replaceChildren(make('h2', {}, title), shown(answer)),
        (error: Error) => place.replaceChildren(make('h2', {}, title), make('p', { className: 'bad' }, error.message)),
      )
    })
    return button
  })
  view.replaceChildren(make('div', { className: 'row' }, ...buttons), place)
}

for (const tab of document.querySelectorAll<HTMLButtonElement>('[data-view]'))
  tab.addEventListener('click', () => {
    for (const other of document.querySelectorAll<HTMLButtonElement>('[data-view]')) {
      const on = other === tab
      other.setAttribute('aria-selected', String(on))
      byId(other.dataset.view ?? '').hidden = !on
    }
    if (tab.dataset.view === 'sessions') void showSessions(begin, showCloud)
    if (tab.dataset.view === 'compare') compare ??= new Compare()
    if (tab.dataset.view === 'corners') showCorners()
    if (tab.dataset.view === 'rig-view') void showRig()
  })

function darken(dark: boolean): void {
  document.body.classList.toggle('dark', dark)
  byId('dark').setAttribute('aria-pressed', String(dark))
  cloud.colour(dark)
  compare?.background(dark)
  localStorage.setItem('dark', dark ? 'yes' : '')
}
byId('dark').addEventListener('click', () => darken(!document.body.classList.contains('dark')))
darken(localStorage.getItem('dark') === 'yes')

connect()
