// The operator's console: what the server says is shown, what the operator wants is asked for.
import { Cloud, SceneMessage } from './cloud'
import { Compare } from './compare'
import { Corners, ToClick } from './corners'
import { fieldOf, valuesOf } from './fields'
import { Judged, judgedCamera, JudgedMessage } from './judged'
import { Feed, Form, Hello, Message, RigChoice, Run, ScoreOf } from './messages'
import { ask, byId, make, shown, Terminal } from './page'
import { PathView } from './path'
import { addressOf, reportFrame } from './report'
import { renew, Results } from './results'
import { showSessions } from './sessions'
import { State } from './state'

const old = 800 // [ms] without a sign of life; four come in a second
const stopOnItsWay = 'STOP is on its way; wait for the devices to confirm.'
const holdEvery = 100 // [ms]; the server lets go after 400

const log = byId<HTMLPreElement>('log')
const terminal = new Terminal()
const cloud = new Cloud(byId('cloud'))
const path = new PathView(byId('path'), () => byId('form').querySelector<HTMLSelectElement>('[name=preset]')?.value ?? '')
const judged = new Judged()
const state = new State()
const results = new Results()
let report: string | undefined // the page that the run has left
let socket: WebSocket | undefined
let you = 0
let role: Hello['role'] = 'watch'
let chosenRig = '' // its name
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
    showAge()
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

function showAge(): void {
  const age = Date.now() - heard
  const lost = heard === 0 || age > old || socket?.readyState !== WebSocket.OPEN
  document.body.classList.toggle('stale', lost)
  byId('connection').textContent = !lost ? 'connected' : heard === 0 ? 'connecting' : `connection lost: what is shown is ${(age / 1000).toFixed(0)} s old`
  byId('connection').className = lost ? 'bad' : ''
}
setInterval(showAge, 100)

// What the server says.

function take(message: Message): void {
  switch (message.is) {
    case 'hello':
      checkVersion(message.page)
      you = message.you
      role = message.role
      byId('leave').hidden = message.user === ''
      byId('leave').title = `${message.user} may ${message.role}`
      state.allow(role !== 'watch')
      offerRigs(message.rigs)
      takeRig(message)
      forget()
      state.run(false, true)
      break
    case 'control':
      holder = message.holder
      offered = message.offered
      say('control', holder === null ? `nobody's` : holder === you ? 'yours' : `${message.holder_name || `browser ${holder}`}'s`, holder === you ? 'good' : '')
      byId('control').title = `${message.browsers} browsers look on`
      showControl()
      break
    case 'run':
      takeRun(message)
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
    case 'answered':
      corners?.snaps(message.answer)
      break
    case 'alive':
      state.alive(message.utc)
      break
    case 'rig':
      takeRig(message)
      break
    case 'known':
      state.known(message)
      break
    case 'disk':
      state.disk(message)
      break
  }
}

function takeRun(message: Run): void {
  const fresh = run?.began_utc !== message.began_utc || run.command !== message.command
  if (fresh) forget()
  run = message
  state.run(runs(), fresh)
  showRun()
}

function takeRig(choice: RigChoice): void {
  const { rig } = choice
  forms = choice.forms
  toClick = rig.click
  byId('rig').textContent = rig.name
  byId('rig').title = `${rig.description} (tankrig ${rig.version})`
  document.title = `${rig.name} - tankrig console`
  say('calibration', rig.calibration, rig.warnings.length > 0 ? 'bad' : '')
  byId('calibration').title = rig.warnings.join('; ')
  const other = choice.chosen !== chosenRig
  chosenRig = choice.chosen
  if (other) forgetRig()
  state.know(rig)
}

function offerRigs(rigs: string[]): void {
  const choice = byId<HTMLSelectElement>('rigs')
  choice.replaceChildren(...rigs.map(name => make('option', { value: name }, name.split('/').filter(part => part).pop() ?? name)))
  choice.closest('label')!.hidden = rigs.length < 2
}

/** Of the one before. */
function forgetRig(): void {
  byId<HTMLSelectElement>('rigs').value = chosenRig
  corners = undefined
  byId('corners').replaceChildren()
  forget()
  chooseForms()
  state.run(false, true)
  state.forgetDevices()
}

/** A new run has nothing of the last one. */
function forget(): void {
  run = undefined
  document.body.classList.remove('running')
  terminal.clear()
  log.textContent = ''
  cloud.clear()
  for (const id of ['cloud-box', 'look', 'look-report', 'report-box']) byId(id).hidden = true
  for (const id of ['stage', 'end', 'cloud-says']) say(id, '')
  byId('report-box').replaceChildren()
  results.clear()
  report = undefined
  judged.clear()
  byId<HTMLProgressElement>('progress').value = 0
  say('laser', '--')
  say('arm', '--')
  say('run-state', 'nothing runs')
  warn('')
}

function fed(message: Feed): void {
  state.fed(message)
  switch (message.feed) {
    case 'progress':
      byId<HTMLProgressElement>('progress').value = Number(message.fraction)
      say('stage', [message.stage, `${(100 * Number(message.fraction)).toFixed(0)} %`, message.detail].filter(part => part).join(', '))
      break
    case 'state':
      if (Array.isArray(message.arm)) cloud.setArm(message.arm as number[][])
      if (message.laser) say('laser', String(message.laser), message.laser === 'on' ? 'lit' : '')
      say('arm', String(message.segment))
      break
    case 'scene':
      byId('cloud-box').hidden = false
      cloud.clear()
      cloud.setScene(message as unknown as SceneMessage)
      break
    case 'judged':
      if (cloud.count === 0) byId('cloud-box').hidden = true // it stays empty
      judged.show(message as unknown as JudgedMessage)
      break
    case 'scores':
      results.scores(message.scores as ScoreOf[])
      break
    case 'plot':
      results.plot(String(message.plot), String(message.title), String(message.svg))
      break
    case 'report':
      report = addressOf(String(message.file))
      byId('look-report').hidden = report === undefined
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
    cloud.add(new Float32Array(data.slice(9))) // behind the stamp of their frame
    say('cloud-says', `${cloud.count} points as they are found; particles are still among them`)
  } else if (kind === 'P') {
    const name = new TextDecoder().decode(bytes.subarray(2, 2 + bytes[1]))
    const camera = judgedCamera(name)
    const image = camera === undefined ? results.picture(name) : judged.picture(camera)
    renew(image, new Blob([bytes.slice(2 + bytes[1])], { type: 'image/jpeg' }))
  }
}

// Control and the run.

function showControl(): void {
  const yours = holder === you && socket?.readyState === WebSocket.OPEN && !document.body.classList.contains('outdated')
  const button = byId<HTMLButtonElement>('take')
  button.textContent = yours ? (offered ? 'Offered: another browser may take it' : 'Offer control') : 'Take control'
  button.disabled = document.body.classList.contains('outdated') || role === 'watch' || (!yours && holder !== null && !offered)
  button.title = role === 'watch' ? 'You may look, and press STOP.' : button.disabled ? 'Another browser is in control; it can offer control.' : ''
  for (const id of ['begin', 'answer-form'])
    for (const part of byId(id).querySelectorAll<HTMLButtonElement | HTMLInputElement>('button, input')) part.disabled = !yours || (id === 'begin' ? !chosen()?.granted || (runs() && !run?.hold) : !runs())
  const form = chosen()
  byId<HTMLSelectElement>('rigs').disabled = !yours || runs()
  for (const input of byId('form').querySelectorAll<HTMLInputElement | HTMLSelectElement>('input, select')) input.disabled = !form?.granted
  byId('why-not').textContent = form && !form.granted ? `This needs the role ${form.role}; yours is ${role}.` : !yours ? 'Take control to start it.' : ''
}

function showRun(): void {
  if (!run) return
  const over = run.exit_code !== null
  const how = !over ? (run.stopping ? 'is being stopped' : 'runs') : run.exit_code === 0 ? 'done' : run.exit_code === 3 ? 'ended in part' : `failed (exit code ${run.exit_code})`
  say('run-state', `${run.title}: ${how}`, over && run.exit_code !== 0 ? 'bad' : '')
  byId('run-title').textContent = `${run.title}: ${how}`
  byId('run-title').title = `tankrig ${run.words.join(' ')}`
  document.body.classList.toggle('running', !over && !run.hold)
  byId('look').hidden = !over || run.command !== 'scan'
  if (over) letGo()
  if (over && cloud.count === 0) byId('cloud-box').hidden = true
  if (over && byId('end').textContent === stopOnItsWay) say('end', run.moves ? 'It has ended: see what it says. STOP asks laser and arm anew.' : '')
  showControl()
}

function stop(): void {
  if (!runs() || !run?.stopping) stopPressed = Date.now()
  say('end', stopOnItsWay)
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
  const before = command.value
  command.replaceChildren(...forms.map(form => make('option', { value: form.name }, form.title)))
  if (forms.some(form => form.name === before)) command.value = before
  showForm()
}
byId('command').addEventListener('change', () => showForm())
byId('rigs').addEventListener('change', () => {
  tell({ do: 'rig', name: byId<HTMLSelectElement>('rigs').value })
  byId<HTMLSelectElement>('rigs').value = chosenRig // until the server says so
})

/** A wish of another view: its form is filled in and started. */
function begin(command: string, given: Record<string, string>): void {
  if (!forms.find(form => form.name === command)?.granted) return warn('Your role does not include this.')
  if (holder !== you) return warn('Take control first: this starts a command.')
  byId<HTMLSelectElement>('command').value = command
  showForm()
  for (const [key, value] of Object.entries(given)) {
    const input = byId<HTMLFormElement>('form').elements.namedItem(key)
    if (input instanceof HTMLInputElement || input instanceof HTMLSelectElement) input.value = value
  }
  show('run')
  const form = chosen()
  if (form) start(form)
}

const chosen = () => forms.find(form => form.name === byId<HTMLSelectElement>('command').value)

function showForm(): void {
  const form = chosen()
  if (!form) return
  byId('what-it-does').textContent = form.what
  byId('form').replaceChildren(...form.fields.map(fieldOf))
  byId('form').querySelector('[name=preset]')?.addEventListener('change', () => path.forget())
  path.offer(form.name === 'scan')
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

/** False: a field is wrong. */
function start(form: Form): boolean {
  const given = valuesOf(byId<HTMLFormElement>('form'), form.fields)
  if (!given) return false
  warn('')
  tell({ do: 'start', command: form.name, options: given })
  return true
}

let holding: number | undefined

/** The first press starts the command; it asks, where it must, before a second one moves the arm. */
function hold(form: Form): void {
  letGo()
  if (!runs() && !start(form)) return
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
  show('compare')
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

const tabs = document.querySelectorAll<HTMLButtonElement>('[data-view]')

/** `newest`: of the sessions, the newest is opened. */
function show(view: string, newest = false): void {
  for (const tab of tabs) {
    const on = tab.dataset.view === view
    tab.setAttribute('aria-selected', String(on))
    byId(tab.dataset.view ?? '').hidden = !on
  }
  if (view === 'sessions') void showSessions(begin, showCloud, newest)
  if (view === 'compare') compare ??= new Compare()
  if (view === 'corners') showCorners()
  if (view === 'rig-view') void showRig()
}
tabs.forEach((tab, i) => {
  const view = tab.dataset.view ?? ''
  tab.id = `tab-${view}`
  tab.setAttribute('aria-controls', view)
  byId(view).setAttribute('aria-labelledby', tab.id)
  tab.addEventListener('click', () => show(view))
  tab.addEventListener('keydown', event => {
    const step = event.key === 'ArrowRight' ? 1 : event.key === 'ArrowLeft' ? tabs.length - 1 : 0
    const next = tabs[(i + step) % tabs.length]
    if (step === 0) return
    next.focus()
    show(next.dataset.view ?? '')
  })
})
byId('look').addEventListener('click', () => show('sessions', true))
byId('look-report').addEventListener('click', () => {
  if (report === undefined) return
  byId('report-box').hidden = false
  byId('report-box').replaceChildren(make('h2', {}, 'Report'), reportFrame(report, 'Report'))
  byId('report-box').scrollIntoView({ block: 'start' })
})

function darken(dark: boolean): void {
  document.body.classList.toggle('dark', dark)
  byId('dark').setAttribute('aria-pressed', String(dark))
  cloud.colour(dark)
  path.colour(dark)
  compare?.background(dark)
  localStorage.setItem('dark', dark ? 'yes' : '')
}
byId('dark').addEventListener('click', () => darken(!document.body.classList.contains('dark')))
darken(localStorage.getItem('dark') === 'yes')

connect()
