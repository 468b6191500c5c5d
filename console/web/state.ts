// State at a glance: what is known of the rig, who said it, and how old that is. While a command runs it is live; while none does,
// it is what the last run, the last answer of a device or the last session left.
import { ask, byId, degrees, make } from './page'

export interface RigFacts {
  name: string
  calibration: string
  calibration_made_utc: string | null
  calibration_verdict: string | null
  warnings: string[]
  joints: { name: string; lower_deg: number; upper_deg: number }[]
}
interface StateFeed {
  joints_deg?: Record<string, number>
  current_a: number
  armed: boolean
  interlock_closed: boolean
  box_enabled: boolean | null
  lit_s: number
  laser?: string
  lost?: Record<string, number>
  wake_ups?: { upper_us: number[]; counts: number[]; longest_us: number; overruns: number }
}
interface CameraFeed { name: string; focus: number; best_focus: number; clipped_share: number; rate_hz?: number; exposure_ms?: number; lost?: number }
interface ArmAnswer {
  homed: boolean
  not_homed?: string
  refusal?: string
  failure?: string
  joints: { name: string; angle_deg: number | null; lower_deg: number; upper_deg: number }[]
  current_a: number
}
interface Finding { what: string; verdict: string; measured: string; cure: string }
export interface Known { what: string; utc: string; answer: unknown; failure?: string }
export interface Listed {
  session: string
  rig?: string
  created_utc?: string
  lux_before?: number
  lux_after?: number
  lost?: Record<string, string>
  timing?: { overruns: number; wake_up_us: { p50: number; p99: number; max: number } }
}

const cards = ['Arm', 'Laser', 'Cameras', 'Real time', 'Light', 'Disk', 'Calibration', 'What is wrong'] as const
type Card = (typeof cards)[number]
interface Fact { from: string; at: number; body: Node[] }
interface Trouble { text: string; cure: string; from: string; at: number }

const fresh = 3000 // [ms] what a run says is live; its times are whole seconds

const line = (text: string, className = '') => make('p', { className }, text)
const rows = (head: string[], body: string[][]) =>
  make('table', {}, make('thead', {}, make('tr', {}, ...head.map(h => make('th', { scope: 'col' }, h)))),
    make('tbody', {}, ...body.map(([name, ...cells]) => make('tr', {}, make('th', { scope: 'row' }, name), ...cells.map(c => make('td', { className: 'number' }, c))))))

/** In words for people. */
export function age(ms: number): string {
  const s = Math.max(0, ms / 1000)
  if (s < 90) return `${s.toFixed(0)} s`
  if (s < 5400) return `${(s / 60).toFixed(0)} min`
  if (s < 129600) return `${(s / 3600).toFixed(0)} h`
  return `${(s / 86400).toFixed(0)} days`
}

/** The bin's upper limit that `share` of all steps do not reach [us]. */
function quantile(counts: number[], upper: number[], share: number): string {
  const wanted = share * counts.reduce((sum, n) => sum + n, 0)
  let seen = 0
  for (let i = 0; i < counts.length; ++i) if ((seen += counts[i]) >= wanted) return i < upper.length ? `below ${upper[i]} µs` : `${upper[upper.length - 1]} µs or more`
  return ''
}

/** Bars of counts, their heights logarithmic: one late step in a million is seen. */
function bars(counts: number[], label: string): SVGSVGElement {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg')
  svg.setAttribute('viewBox', `0 0 ${counts.length * 10} 30`)
  svg.setAttribute('preserveAspectRatio', 'none')
  svg.setAttribute('role', 'img')
  svg.setAttribute('aria-label', label)
  const most = Math.log1p(Math.max(1, ...counts))
  counts.forEach((n, i) => {
    const bar = document.createElementNS('http://www.w3.org/2000/svg', 'rect')
    const height = (29 * Math.log1p(n)) / most
    for (const [key, value] of Object.entries({ x: i * 10 + 1, y: 30 - height, width: 8, height })) bar.setAttribute(key, String(value))
    svg.append(bar)
  })
  return svg
}

export class State {
  private now = 0 // the server's clock [ms]
  private running = false
  private rig: RigFacts | undefined
  private lost: Record<string, number> = {}
  private cameras: CameraFeed[] = []
  private troubles: Trouble[] = [] // of the run
  private doctor: Trouble[] = []
  private arm: Trouble[] = []
  private session: Trouble[] = []
  private readonly facts = new Map<Card, Fact>()
  private readonly places = new Map<Card, { body: HTMLElement; from: HTMLElement }>()
  private readonly asks: HTMLButtonElement[] = []

  constructor() {
    for (const card of cards) {
      const [body, from] = [make('div', {}, '--'), make('small', {}, 'not known')]
      this.places.set(card, { body, from })
      const wide = card === 'Arm' || card === 'Cameras'
      byId('state-cards').append(make('section', { className: wide ? 'wide' : '', id: `state-${card.toLowerCase().replace(/ /g, '-')}` }, make('h3', {}, card), body, from))
    }
    for (const [question, title] of [['arm', 'Read the arm'], ['doctor', 'Check this machine']]) {
      const button = make('button', { type: 'button' }, title)
      button.addEventListener('click', () => {
        button.disabled = true
        ask(question).catch(() => undefined).finally(() => { button.disabled = false }) // the answer comes to all browsers
      })
      this.asks.push(button)
    }
    byId('state-asks').append(...this.asks, make('small', {}, 'Both move nothing.'))
  }

  /** Who may ask devices. */
  allow(may: boolean): void {
    byId('state-asks').hidden = !may
  }

  /** The server's time, four times a second. */
  alive(utc: string): void {
    const now = Date.parse(utc)
    if (now === this.now) return
    this.now = now
    for (const card of cards) this.drawAge(card)
  }

  run(running: boolean, fresh: boolean): void {
    if (fresh) this.forget()
    const ended = this.running && !running
    this.running = running
    for (const button of this.asks) button.disabled = running
    if (ended) void this.askLast()
  }

  /** What devices and sessions of another rig have said. */
  forgetDevices(): void {
    this.arm = this.doctor = this.session = []
    for (const card of ['Arm', 'Laser', 'Cameras', 'Real time', 'Light'] as const) {
      this.facts.delete(card)
      this.places.get(card)?.body.replaceChildren('--')
      this.places.get(card)?.from.replaceChildren('not known')
    }
    this.drawTroubles()
  }

  private forget(): void {
    this.troubles = []
    this.lost = {}
    this.cameras = []
    this.drawTroubles()
  }

  /** Of this rig, the newest. */
  async askLast(): Promise<void> {
    try {
      const all = (await ask('sessions')) as Listed[]
      const last = all.filter(s => s.rig === this.rig?.name && s.created_utc).pop()
      if (last && !this.running) this.last(last) // else it is the one that is being recorded
    } catch {
      // the list itself says so where somebody looks at it
    }
  }

  private last(s: Listed): void {
    const at = s.created_utc ?? ''
    const from = `session ${s.session.split('/').pop()}`
    const lux = s.lux_after ?? s.lux_before
    if (lux !== undefined) this.put('Light', from, at, [line(`${lux.toPrecision(3)} lx`)])
    if (s.timing) {
      const { p50, p99, max } = s.timing.wake_up_us
      this.put('Real time', from, at, [line(`woken late by ${p50.toFixed(0)} µs (median), ${p99.toFixed(0)} µs (99 %), at most ${max.toFixed(0)} µs`), line(`${s.timing.overruns} cycles late`)])
    }
    const lost = Object.entries(s.lost ?? {})
    if (!this.facts.has('Cameras')) this.put('Cameras', from, at, [line(lost.length === 0 ? 'lost no frame' : 'lost frames', lost.length === 0 ? '' : 'bad')])
    this.session = lost.map(([camera, account]) => ({ text: `camera ${camera}: ${account}`, cure: '', from, at: Date.parse(at) }))
    this.drawTroubles()
  }

  know(rig: RigFacts): void {
    const other = this.rig?.name !== rig.name
    this.rig = rig
    if (other) void this.askLast()
    const made = rig.calibration_made_utc
    const verdict = rig.calibration_verdict
    this.put('Calibration', '', '', [
      line(rig.calibration),
      ...(verdict ? [line(verdict, verdict === 'accepted' ? 'good' : 'bad')] : []),
      ...(made ? [make('p', { className: 'age', title: made }, '')] : []),
    ])
    this.drawTroubles()
    this.drawAge('Calibration')
  }

  disk(message: { utc: string; free_bytes?: number; bytes?: number }): void {
    if (message.free_bytes === undefined || message.bytes === undefined) return this.put('Disk', 'this server', message.utc, [line('not known', 'bad')])
    const meter = make('progress', { value: message.bytes - message.free_bytes, max: message.bytes })
    meter.setAttribute('aria-label', 'Disk used')
    this.put('Disk', 'this server', message.utc, [line(`${(message.free_bytes / 1e9).toFixed(1)} GB free of ${(message.bytes / 1e9).toFixed(0)} GB`), meter])
  }

  known({ what, utc, answer, failure }: Known): void {
    const at = Date.parse(utc)
    if (what === 'arm') {
      const arm = answer as ArmAnswer | null
      this.arm = failure ? [{ text: failure, cure: '', from: 'arm status', at }] : []
      if (arm) {
        if (!arm.homed) this.arm.push({ text: `the arm is not homed${arm.not_homed ? `: ${arm.not_homed}` : ''}`, cure: 'Home', from: 'arm status', at })
        for (const trouble of [arm.failure, arm.refusal]) if (trouble) this.arm.push({ text: trouble, cure: '', from: 'arm status', at })
        this.put('Arm', 'arm status', utc, this.armBody(arm.joints.map(j => ({ ...j, deg: j.angle_deg })), arm.homed, arm.current_a))
      }
    }
    if (what === 'doctor') {
      const findings = (answer as { findings?: Finding[] } | null)?.findings ?? []
      const bad = findings.filter(f => f.verdict === 'bad' || (f.verdict === 'not there' && f.cure !== ''))
      this.doctor = bad.map(f => ({ text: `${f.what}: ${f.measured}`, cure: f.cure, from: 'doctor', at }))
      if (failure) this.doctor.push({ text: failure, cure: '', from: 'doctor', at })
      const latency = findings.find(f => f.what.includes('latency'))
      if (latency) this.put('Real time', 'doctor', utc, [line(latency.measured, latency.verdict === 'bad' ? 'bad' : '')])
    }
    this.drawTroubles()
  }

  fed(message: { feed: string; utc: string; [key: string]: unknown }): void {
    if (message.feed === 'state') this.fedState(message as unknown as StateFeed, message.utc)
    if (message.feed === 'cameras') {
      this.cameras = message.cameras as CameraFeed[]
      this.drawCameras(message.utc)
    }
    if (message.feed === 'lux') this.put('Light', message.source === 'meter' ? 'the lux meter' : 'the operator', message.utc, [line(`${Number(message.lux).toPrecision(3)} lx`)])
    if (message.feed === 'end')
      this.put('Laser', 'the run', message.utc, [line(message.laser_dark ? 'off, confirmed' : 'NOT CONFIRMED OFF', message.laser_dark ? 'good' : 'bad')])
    if (message.feed === 'told' && message.level === 'warning') {
      this.troubles.push({ text: String(message.text), cure: '', from: 'the run', at: Date.parse(message.utc) })
      this.drawTroubles()
    }
  }

  private fedState(state: StateFeed, utc: string): void {
    const joints = this.rig?.joints ?? []
    if (state.joints_deg) this.put('Arm', 'the run', utc, this.armBody(joints.map(j => ({ ...j, deg: state.joints_deg?.[j.name] ?? null })), true, state.current_a))
    const yes = (value: boolean | null, is: string, not: string) => (value === null ? 'none' : value ? is : not)
    this.put('Laser', 'the run', utc, [
      line(`${state.laser ?? 'not heard yet'}${state.armed ? ', armed' : ', not armed'}`, state.laser === 'on' ? 'lit' : ''),
      line(`interlock ${yes(state.interlock_closed, 'closed', 'open')}, enable input ${yes(state.box_enabled, 'closed', 'open')}`),
      line(`on for ${state.lit_s.toFixed(1)} s in this run`),
    ])
    this.lost = state.lost ?? {}
    this.drawCameras(utc)
    if (!state.wake_ups) return this.put('Real time', 'the run', utc, [line('a virtual clock: nothing can be late')])
    const { counts, upper_us, longest_us, overruns } = state.wake_ups
    const says = `woken late: median ${quantile(counts, upper_us, 0.5)}, 99 % ${quantile(counts, upper_us, 0.99)}, at most ${longest_us.toFixed(0)} µs`
    this.put('Real time', 'the run', utc, [line(says), bars(counts, `${says}; four bars to a doubling, from 1 µs`), line(`${overruns} cycles late`, overruns > 0 ? 'bad' : '')])
  }

  private armBody(joints: { name: string; deg: number | null; lower_deg: number; upper_deg: number }[], homed: boolean, current: number): Node[] {
    return [
      rows(['joint', 'angle', 'limits'], joints.map(j => [j.name, j.deg === null ? '--' : degrees(j.deg), `${j.lower_deg.toFixed(0)} to ${j.upper_deg.toFixed(0)}°`])),
      line(`${homed ? 'homed' : 'NOT HOMED'}, ${current.toFixed(2)} A`, homed ? '' : 'bad'),
    ]
  }

  private drawCameras(utc: string): void {
    const names = [...new Set([...this.cameras.map(c => c.name), ...Object.keys(this.lost)])]
    if (names.length === 0) return
    const body = names.map(name => {
      const c = this.cameras.find(camera => camera.name === name)
      const lost = this.lost[name] ?? c?.lost
      return [name, c?.rate_hz === undefined ? '--' : `${c.rate_hz.toFixed(1)}/s`, lost === undefined ? '--' : String(lost), c?.exposure_ms === undefined ? '--' : `${c.exposure_ms.toFixed(2)} ms`,
        c ? `${c.focus.toFixed(0)} of ${c.best_focus.toFixed(0)}` : '--', c ? `${(100 * c.clipped_share).toFixed(2)} %` : '--']
    })
    this.put('Cameras', 'the run', utc, [rows(['camera', 'frames', 'lost', 'exposure', 'focus', 'saturated'], body)])
  }

  private drawTroubles(): void {
    const rig = (this.rig?.warnings ?? []).map(text => ({ text, cure: '', from: 'the rig file', at: 0 }))
    const all = [...rig, ...this.troubles, ...this.arm, ...this.doctor, ...this.session]
    this.put('What is wrong', '', '', all.length === 0 ? [line('Nothing that is known.')] : [
      make('ul', {}, ...all.map(t => make('li', { className: 'bad' }, t.text, ...(t.cure ? [make('p', {}, `Cure: ${t.cure}`)] : []), ' ', make('small', { className: 'age' }, t.from)))),
    ])
  }

  /** `utc`: empty where it has no age of its own. What is older than what is shown is not shown. */
  private put(card: Card, from: string, utc: string, body: Node[]): void {
    const at = utc === '' ? 0 : Date.parse(utc)
    const shown = this.facts.get(card)
    if (shown && at < shown.at) return
    this.facts.set(card, { from, at, body })
    this.places.get(card)?.body.replaceChildren(...body)
    this.drawAge(card)
  }

  private drawAge(card: Card): void {
    const fact = this.facts.get(card)
    const place = this.places.get(card)
    if (!fact || !place) return
    const since = this.now - fact.at
    const live = ((fact.from === 'the run' || fact.from === 'the lux meter') && this.running && since < fresh) || (fact.from === 'this server' && since < 2 * fresh)
    place.from.textContent = fact.from === '' ? '' : live ? 'live' : `${fact.from}, ${age(since)} ago`
    place.body.classList.toggle('old', fact.from !== '' && !live)
    const made = place.body.querySelector<HTMLElement>('p.age')
    if (made) made.textContent = `made ${age(this.now - Date.parse(made.title))} ago`
  }
}
