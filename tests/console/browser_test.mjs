// The console as an operator meets it: `tankrig serve` and a browser. Arguments: rig, program, folder with node_modules,
// browser.
import assert from 'node:assert/strict'
import { execFileSync, spawn, spawnSync } from 'node:child_process'
import { cpSync, existsSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, renameSync, rmSync, writeFileSync } from 'node:fs'
import http from 'node:http'
import { tmpdir } from 'node:os'
import { monitorEventLoopDelay } from 'node:perf_hooks'
import { join } from 'node:path'
import { after, afterEach, before, beforeEach, test } from 'node:test'

import { launchBrowser } from './browser.mjs'
import { keep, pictures } from './pictures.mjs'
import { edit, expectNothingOpen, smallRig, until as within, wholeRig } from './small_rig.mjs'
import { watch } from './watcher.mjs'

const [rig, program, web, executablePath] = process.argv.slice(2)
const wires = rig !== 'tank-sim'
const patience = wires ? 120_000 : 60_000 // [ms] for a whole scan
const mostLate = 50 // [ms] that this process may wake late where the clock judges
const pingAnswered = 750 // [ms] within which a watcher answers, or it is let go
const drawnWithin = 500 // [ms] from a frame's stamp to its points on the page
const stopBound = 100 // [ms] from a click to the laser's command, on loopback
const makeRig = pictures && !wires ? wholeRig : smallRig
const [brief, long] = wires || pictures ? ['', ''] : ['short', 'long'] // presets of a scan that is waited for, and of one that is stopped

const until = (what, condition, milliseconds = patience) => within(what, condition, milliseconds)

let browser, folder, server, address, small

const launch = () => launchBrowser(web, executablePath)

/** A process, what it printed, and its exit code once nobody holds its output: what it started must not outlive it. */
function serve() {
  const child = spawn(program, ['serve', '--rig', join(folder, 'rig'), '--port', '0'], { cwd: folder, stdio: ['ignore', 'pipe', 'pipe'] })
  child.said = ''
  for (const stream of [child.stdout, child.stderr]) stream.on('data', data => { child.said += data })
  child.over = new Promise(done => child.on('close', code => done(code)))
  return child
}

async function begin() {
  server = serve()
  await until('the address', () => /http:\S+/.test(server.said) || server.exitCode !== null, 10_000)
  address = /http:\S+/.exec(server.said)?.[0]
  assert.ok(address, server.said)
}

const open = async (width = 1280, height = 900) => {
  const context = await browser.newContext({ viewport: { width, height } })
  const page = await context.newPage()
  page.bad = []
  page.on('pageerror', error => page.bad.push(String(error)))
  page.on('console', message => { if (message.type() === 'error') page.bad.push(message.text()) })
  await page.addInitScript(watchDrawing)
  await page.goto(address)
  await page.getByText('connected', { exact: true }).waitFor()
  return page
}

/** In the page: of each message of points its frame's stamp [ms] and the points so far; of each drawing of the cloud its points, and when it was
 * shown [ms, as Date.now()]. */
function watchDrawing() {
  window.came = []
  window.drawn = []
  let points = 0
  window.WebSocket = class extends WebSocket {
    constructor(...where) {
      super(...where)
      this.addEventListener('message', ({ data }) => {
        if (!(data instanceof ArrayBuffer) || new Uint8Array(data)[0] !== 0x4c) return
        points += (data.byteLength - 9) / 12
        window.came.push({ stamp: Number(new DataView(data).getBigInt64(1, true)) / 1e6, points })
      })
    }
  }
  const draw = WebGL2RenderingContext.prototype.drawArrays
  WebGL2RenderingContext.prototype.drawArrays = function (mode, first, points) {
    draw.call(this, mode, first, points)
    if (mode !== this.POINTS || !this.canvas.closest('#cloud')) return
    requestAnimationFrame(() => requestAnimationFrame(() => window.drawn.push({ points, when: Date.now() })))
  }
}

/** From each frame's stamp to the picture with all its points [ms]. */
async function drawnAfter(page) {
  const { came, drawn } = await page.evaluate(() => ({ came: window.came, drawn: window.drawn }))
  const monotonic = monotonicAhead()
  return came.map(({ stamp, points }) => drawn.find(picture => picture.points >= points).when + monotonic - stamp)
}
/** Of a session's stamps, less this machine's clock [ms]. */
const monotonicAhead = () => Number(process.hrtime.bigint()) / 1e6 - Date.now()

const points = async page => Number((await page.locator('#cloud-says').textContent()).split(' ')[0] || 0)
const run = page => page.locator('#run-state')
const sessions = () => (existsSync(join(folder, 'sessions')) ? readdirSync(join(folder, 'sessions')).filter(name => name.includes('-2')) : [])
const events = name => readFileSync(join(folder, 'sessions', name, 'events.csv'), 'utf8').trim().split('\n').slice(1)
const status = name => /^status: (.*)$/m.exec(readFileSync(join(folder, 'sessions', name, 'session.yaml'), 'utf8'))?.[1] ?? ''

async function start(page, command = 'scan', preset = command === 'scan' ? long : '') {
  await page.getByRole('button', { name: 'Take control' }).click()
  await page.locator('#control', { hasText: 'yours' }).waitFor()
  await page.locator('#command').selectOption(command)
  if (preset) await page.getByLabel('Preset').selectOption(preset)
  await page.locator('#start').click()
}
const witness = monitorEventLoopDelay({ resolution: 5 })

/** Where something was late: skips if this process was, too, and fails if it was not. */
function skipIfLate(t, what, allowed = mostLate) {
  const late = witness.max / 1e6
  assert.ok(late > allowed, `${what}; this process woke at most ${late.toFixed(1)} ms late`)
  t.skip(`${what}: skipped because the machine was late: by ${late.toFixed(1)} ms, at most ${allowed.toFixed(1)} ms allowed`)
}

/** Waits for what a scan brings. In virtual time it always comes; over wires a machine that is late may end the scan before. */
async function brings(page, t, what, condition, milliseconds) {
  const over = async () => / (done|ended in part|failed)/.test(await run(page).textContent())
  await until(what, async () => (await condition()) || (await over()), milliseconds)
  if (await condition()) return true
  const said = await page.locator('#log').textContent()
  assert.ok(wires, said)
  skipIfLate(t, said.trim().split('\n').pop())
  return false
}
const sweeps = (page, t) => brings(page, t, 'the sweep', async () => (await points(page)) > 0)

before(async () => {
  browser = await launch()
  small = join(mkdtempSync(join(tmpdir(), 'tankrig-test-')), rig) // its folder gives it its name
  makeRig(program, rig, small)
})
/** Of the test before. Called before each, too: node calls no afterEach for a test that skipped itself. */
async function end() {
  for (const context of browser.contexts()) await context.close()
  if (server === undefined) return
  if (server.exitCode === null && server.signalCode === null) server.kill('SIGINT')
  await server.over
  server = undefined
  // A command may still be closing its session: what it adds while the folder is emptied is found by another try.
  const isGone = () => {
    try { rmSync(folder, { recursive: true, force: true }) } catch (error) { if (error.code !== 'ENOTEMPTY') throw error }
    return !existsSync(folder)
  }
  await until('the folder is empty', isGone, 20_000)
}
beforeEach(async () => {
  await end()
  folder = mkdtempSync(join(tmpdir(), 'tankrig-test-'))
  cpSync(small, join(folder, 'rig'), { recursive: true })
  witness.enable()
  witness.reset()
  await begin()
})
afterEach(end)
after(async () => {
  expectNothingOpen()
  await end()
  await browser.close()
  rmSync(join(small, '..'), { recursive: true, force: true })
})

const answer = (path, headers = {}, method = 'GET') =>
  new Promise((done, failed) => {
    const { hostname, port } = new URL(address)
    const request = http.request({ hostname, port, path, method, headers }, response => {
      response.resume()
      response.on('end', () => done(response))
    })
    request.on('error', failed)
    request.on('upgrade', (response, socket) => { socket.destroy(); done(response) })
    request.end()
  })

test('only a browser with the key is let in, from this page alone', async () => {
  const { host, search } = new URL(address)
  const let_in = await answer(`/${search}`)
  assert.equal(let_in.statusCode, 303)
  const Cookie = let_in.headers['set-cookie'][0].split(';')[0]
  assert.match(let_in.headers['set-cookie'][0], /HttpOnly; SameSite=Strict/)
  assert.equal((await answer('/', { Cookie })).statusCode, 200)
  assert.equal((await answer('/')).statusCode, 403)
  assert.equal((await answer('/?key=0')).statusCode, 403)
  assert.equal((await answer('/', { Cookie, Host: 'evil.example' })).statusCode, 403)
  assert.equal((await answer('/', { Cookie }, 'POST')).statusCode, 405)
  assert.equal((await answer('/sessions/..%2f..%2fetc/passwd', { Cookie })).statusCode, 404)
  assert.equal((await answer('/%00', { Cookie })).statusCode, 400)
  const upgrade = { Cookie, Connection: 'Upgrade', Upgrade: 'websocket', 'Sec-WebSocket-Version': '13', 'Sec-WebSocket-Key': 'dGhlIHNhbXBsZSBub25jZQ==' }
  assert.equal((await answer('/live', { ...upgrade, Origin: `http://${host}` })).statusCode, 101)
  assert.equal((await answer('/live', { ...upgrade, Origin: 'http://evil.example' })).statusCode, 403)
  assert.equal((await answer('/live', upgrade)).statusCode, 403)
})

/** The share of a picture that is neither grey nor white. */
const coloured = picture => picture.evaluate(async canvas => {
  const bitmap = await createImageBitmap(canvas)
  const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d')
  context.drawImage(bitmap, 0, 0)
  const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height)
  let some = 0
  for (let i = 0; i < data.length; i += 4) if (Math.max(data[i], data[i + 1], data[i + 2]) - Math.min(data[i], data[i + 1], data[i + 2]) > 100) ++some
  return some / (data.length / 4)
})

/** A cloud as CSV and PLY, all as zip and bag: what arrives is what lies on the disk. */
async function downloads(page, session) {
  const arrived = async what => {
    const [download] = await Promise.all([page.waitForEvent('download'), what.click()])
    return download.path()
  }
  await page.getByRole('tab', { name: 'Sessions' }).click()
  await page.locator('#sessions tbody button', { hasText: session }).first().click()
  const ply = readFileSync(join(folder, 'sessions', session, 'clouds/laser.ply'))
  assert.deepEqual(readFileSync(await arrived(page.getByRole('link', { name: 'laser as PLY' }))), ply)
  const [head, ...lines] = readFileSync(await arrived(page.getByRole('button', { name: 'laser as CSV' })), 'utf8').trimEnd().split('\n')
  const text = ply.toString('latin1')
  assert.match(head, /^x,y,z,/)
  assert.equal(lines.length, Number(/element vertex (\d+)/.exec(text)[1]))
  assert.equal(Number(lines[0].split(',')[0]), Number(ply.readFloatLE(text.indexOf('end_header\n') + 11).toPrecision(9)))

  const unpacked = join(folder, 'unpacked')
  execFileSync('python3', ['-m', 'zipfile', '-e', await arrived(page.getByRole('button', { name: 'all as zip' })), unpacked])
  const files = place => readdirSync(place, { recursive: true, withFileTypes: true }).filter(entry => entry.isFile()).map(entry => join(entry.parentPath ?? entry.path, entry.name).slice(place.length)).sort()
  const [there, here] = [files(join(folder, 'sessions', session)), files(join(unpacked, session))]
  assert.deepEqual(here, there)
  assert.ok(there.length > 20, String(there))
  for (const file of there) assert.deepEqual(readFileSync(join(unpacked, session, file)), readFileSync(join(folder, 'sessions', session, file)), file)

  const without = page.getByText('built without librosbag-storage') // where this program cannot, the page says so
  const bag = await Promise.any([arrived(page.getByRole('button', { name: 'all as ROS bag' })), without.waitFor().then(() => undefined)])
  if (bag) assert.equal(readFileSync(bag, 'latin1').slice(0, 13), '#ROSBAG V2.0\n')
  assert.deepEqual(readdirSync(join(folder, 'sessions')).filter(name => name.startsWith('.')), [])
}

/** What the page knows after a scan, and a page that comes later. */
async function state(page) {
  const card = (from, name) => from.locator(`#state-${name}`).textContent()
  await page.getByRole('tab', { name: 'Run' }).click()
  assert.match(await card(page, 'arm'), /slew-?[\d.]+°-?\d+ to \d+°.*homed, [\d.]+ A.*the run, \d+ \w+ ago/)
  assert.match(await card(page, 'laser'), /off, confirmed.*ago/)
  assert.match(await card(page, 'cameras'), wires ? /mono\d+\.\d\/s\d+[\d.]+ ms\d+ of \d+\d?[\d.]+ %/ : /mono\d+\.\d\/s0[\d.]+ ms\d+ of \d+\d?[\d.]+ %/)
  assert.match(await card(page, 'real-time'), wires ? /woken late: median below \d+ µs.*\d+ cycles late/ : /a virtual clock/)
  assert.match(await card(page, 'light'), /[\d.]+ lx(the lux meter|session \S+), \d+ \w+ ago/)
  assert.match(await card(page, 'disk'), /[\d.]+ GB free of \d+ GBlive/)
  assert.match(await card(page, 'calibration'), /none: the rig file's values/)
  assert.match(await card(page, 'what-is-wrong'), wires ? /./ : /Nothing that is known/)
  await page.getByRole('button', { name: 'Read the arm' }).first().click()
  const other = await open()
  await until('the arm, told to all', async () => /arm status, \d+ s ago/.test(await card(other, 'arm')))
  for (const [id, end] of [['#laser', 'off, confirmed'], ['#arm', 'at rest, confirmed'], ['#state-laser', 'off, confirmed']]) assert.match(await other.locator(id).textContent(), new RegExp(end), 'told to who comes later')
  await until('the session', async () => /lx.*session/.test(await card(other, 'light')) || /lux meter/.test(await card(other, 'light')))
  await keep(other, 'console_state')
  await other.context().close()
}

/** Where the drawing has them: on a simulated rig that is the truth. */
async function clickCorners(page, session) {
  const place = join(folder, 'sessions', `calibration-${await page.locator('#rig').textContent()}`)
  mkdirSync(place)
  cpSync(join(session, 'frames/mono', readdirSync(join(session, 'frames/mono')).sort()[0]), join(place, 'object.png'))
  await page.getByRole('tab', { name: 'Corners' }).click()
  await page.getByText('Click 4 corners or more').waitFor()
  const canvas = page.locator('.clicking canvas').first()
  const truth = await page.evaluate(async () => {
    const socket = new WebSocket(`ws://${location.host}/live`)
    return new Promise(done => socket.addEventListener('message', event => {
      if (typeof event.data !== 'string') return
      const message = JSON.parse(event.data)
      if (message.is === 'hello') { socket.close(); done(message.rig.click) }
    }))
  })
  const seen = truth.corners.filter(corner => corner.seen)
  assert.ok(seen.length >= 6, `${seen.length} corners are seen`)
  const box = await canvas.boundingBox()
  for (const corner of seen) {
    await page.getByRole('button', { name: corner.name }).click()
    await canvas.click({ position: { x: (corner.pixel_px[0] + 0.5) * box.width / truth.width_px, y: (corner.pixel_px[1] + 0.5) * box.height / truth.height_px } })
  }
  await page.getByRole('button', { name: 'Save the corners' }).click()
  await page.getByText(/The clicks err by [\d.]+ px; snapped to the edges/).waitFor()
  await keep(page, 'console_corners')
  const answer = spawnSync(program, ['calibrate', 'object', '--corners', join(place, 'corners.yaml'), '--image', join(place, 'object.png'),
    '--camera', join(session, 'cameras/mono.yaml'), '--object', join(session, 'black_box.obj'), '--json'], { encoding: 'utf8' })
  assert.ok(answer.status === 0 || answer.status === 3, answer.stderr) // 3: a corner stays as clicked
  const found = JSON.parse(answer.stdout)
  assert.ok(found.raw_rms_px < 1, `the clicks err by ${found.raw_rms_px} px`)
  assert.equal(found.corners.length, seen.length)
  for (const { name, clicked_px, snapped_px, not_snapped } of found.corners) {
    const told = not_snapped ? `not snapped: ${not_snapped}` : `snapped by ${Math.hypot(snapped_px[0] - clicked_px[0], snapped_px[1] - clicked_px[1]).toFixed(2)} px`
    assert.ok((await page.getByRole('button', { name }).textContent()).endsWith(`, ${told}`), `${name}: ${told}`)
  }
  const astray = found.corners.filter(corner => corner.snapped_px).map(({ name, snapped_px: [u, v] }) => {
    const [x, y] = truth.corners.find(corner => corner.name === name).pixel_px
    return Math.hypot(u - x, v - y)
  })
  const told = `of ${seen.length} corners, snapped ones lie ${astray.map(d => d.toFixed(2)).join(', ')} px off the truth`
  assert.ok(astray.length >= 5 && Math.max(...astray) < 0.5, told)
  await canvas.press('ArrowLeft')
  await page.getByRole('button', { name: /snapped/ }).nth(found.corners.length - 1).waitFor({ state: 'detached' })
}

/** The share of a picture's pixels that are not of `other`, of the same size; without it, not white. */
const drawn = (picture, other) => picture.evaluate(async (canvas, other) => {
  const pixels = async source => {
    const bitmap = await createImageBitmap(source)
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d')
    context.drawImage(bitmap, 0, 0)
    return context.getImageData(0, 0, bitmap.width, bitmap.height).data
  }
  const here = await pixels(canvas)
  const image = new Image() // which the page's policy allows, unlike a fetch
  if (other) image.src = other
  const there = other ? await image.decode().then(() => pixels(image)) : undefined
  let some = 0
  for (let i = 0; i < here.length; i += 4) if ([0, 1, 2].some(c => Math.abs(here[i + c] - (there ? there[i + c] : 255)) > 8)) ++some
  return some / (here.length / 4)
}, other)
const picture = canvas => canvas.evaluate(element => element.toDataURL())

test('the path of a scan is drawn before it runs, with its clearance', { skip: wires && 'the plan is the same' }, async () => {
  const truth = JSON.parse(execFileSync(program, ['scan', '--dry-run', '--json', '--rig', join(folder, 'rig')], { cwd: folder, stdio: ['ignore', 'pipe', 'ignore'] }))
  const page = await open()
  await page.getByRole('button', { name: 'Show the planned path' }).click()
  const canvas = page.locator('#path canvas')
  await canvas.waitFor()
  await until('a drawing', async () => (await drawn(canvas)) > 0.01, 10_000)
  assert.match(await page.locator('#path-nearest').textContent(), new RegExp(`: ${Math.round(1e3 * truth.clearance_m)} mm, ${truth.nearest}, `))
  assert.match(await page.locator('#path-says').textContent(), new RegExp(`^0\\.0 of ${truth.duration_s.toFixed(1)} s, .*laser off; nearest here: \\d+ mm`))
  const parked = await picture(canvas)
  await page.getByLabel('Time along the path').fill('120')
  assert.match(await page.locator('#path-says').textContent(), /sweep pass \d, laser on/)
  await until('arm and sheet elsewhere', async () => (await drawn(canvas, parked)) > 0.03, 10_000)
  await keep(page, 'console_path')
  await page.getByRole('button', { name: 'Where it is nearest' }).click()
  const nearest = /nearest here: (\d+) mm/.exec(await page.locator('#path-says').textContent())[1]
  assert.ok(Math.abs(nearest - 1e3 * truth.clearance_m) < 10, `${nearest} mm`)
  const before = await page.locator('#path-says').textContent()
  await page.getByRole('button', { name: 'Play' }).click()
  await until('the arm moves on', async () => (await page.locator('#path-says').textContent()) !== before, 5000)
  await page.getByRole('button', { name: 'Dark room' }).click()
  await keep(page, 'console_path_dark')
  await page.getByLabel('Preset').selectOption('fine')
  await canvas.waitFor({ state: 'hidden' })
  await page.getByRole('button', { name: 'Show the planned path' }).click()
  await canvas.waitFor()
  assert.ok(!(await page.locator('#path-says').textContent()).includes(` of ${truth.duration_s.toFixed(1)} s`), 'the preset\'s own plan')
  await page.locator('#command').selectOption('park')
  await canvas.waitFor({ state: 'hidden' })
  assert.deepEqual(page.bad, [])
})

test('a number out of range is refused where it is typed, in the words of the command', { skip: wires && 'the form is the same' }, async () => {
  const page = await open()
  const refused = words => spawnSync(program, ['scan', '--rig', join(folder, 'rig'), ...words], { cwd: folder, encoding: 'utf8' }).stderr
  const field = name => page.locator(`[name=${name}]`)
  const note = name => page.locator(`label:has([name=${name}]) .bad`)
  await page.getByRole('button', { name: 'Take control' }).click()
  await page.locator('#control', { hasText: 'yours' }).waitFor()
  for (const [name, bad, good] of [['light', '-0.1', '1'], ['noise', '7', '0.02'], ['lux', '20000000', '150']]) {
    const input = field(name)
    await input.fill(bad)
    const said = await note(name).textContent()
    assert.match(said, /^found '.*', expected a number from \d/)
    const [found, expected] = said.split(', expected ')
    const words = refused([`--${name}=${bad}`])
    assert.ok(words.includes(`--${name}: ${found}, `) && words.includes(expected), words)
    await page.locator('#start').click()
    assert.equal(await input.evaluate(element => element === document.activeElement), true, 'the browser leads to it')
    await input.fill(good)
    assert.equal(await note(name).textContent(), '')
  }
  await field('seed').fill('1.5')
  assert.equal(await note('seed').textContent(), "found '1.5', expected a whole number of at least 0")
  await page.locator('#start').click()
  assert.equal(await run(page).textContent(), 'nothing runs')
  assert.deepEqual(sessions(), [])
})

/** Texts whose contrast is below what WCAG 2.1 AA asks for, and controls without a name. */
const hardToUse = page => page.evaluate(() => {
  const parse = colour => (/rgba?\(([^)]+)\)/.exec(colour)?.[1].split(/[ ,/]+/).map(Number) ?? [0, 0, 0, 0])
  const over = ([r, g, b, a = 1], [R, G, B]) => [r * a + R * (1 - a), g * a + G * (1 - a), b * a + B * (1 - a)]
  const light = rgb => rgb.map(c => (c / 255 <= 0.03928 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4)).reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0)
  const behind = element => {
    const layers = []
    for (let at = element; at; at = at.parentElement) layers.push(parse(getComputedStyle(at).backgroundColor))
    return layers.reverse().reduce((under, layer) => over(layer, under), [255, 255, 255])
  }
  const found = []
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT)
  while (texts.nextNode()) {
    const element = texts.currentNode.parentElement
    if (!texts.currentNode.textContent.trim() || !element.checkVisibility() || element.closest('option, script, svg, :disabled')) continue
    const style = getComputedStyle(element), ground = behind(element)
    let clear = 1
    for (let at = element; at; at = at.parentElement) clear *= Number(getComputedStyle(at).opacity)
    const [r, g, b] = parse(style.color)
    const [more, less] = [light(over([r, g, b, clear], ground)), light(ground)].sort((p, q) => q - p)
    const contrast = (more + 0.05) / (less + 0.05)
    const large = parseFloat(style.fontSize) >= 24 || (parseFloat(style.fontSize) >= 18.66 && Number(style.fontWeight) >= 700)
    if (contrast < (large ? 3 : 4.5)) found.push(`${texts.currentNode.textContent.trim().slice(0, 40)}: ${contrast.toFixed(1)}`)
  }
  for (const element of document.querySelectorAll('button, input, select, iframe, img, canvas, progress')) {
    const name = element.getAttribute('aria-label') || element.getAttribute('alt') || element.title || element.labels?.[0]?.textContent || element.closest('label')?.textContent || (element.tagName === 'BUTTON' && element.textContent)
    if (element.checkVisibility() && !name) found.push(`${element.outerHTML.slice(0, 80)}: no name`)
  }
  return found
})

test('what is bad stands out, and all can be read, in a dark room too', { skip: wires && 'the page is the same' }, async () => {
  const page = await open()
  const finding = (what, verdict, more = {}) => ({ what, verdict, measured: 'as it is', cure: '', refused: false, ...more })
  await page.route('**/api/doctor', route => route.fulfill({ json: { rig: 'tank', can_run: false, findings: [finding('kernel', 'good'), finding('disk', 'bad', { cure: 'another disk', refused: true }), finding('governor', 'not there')] } }))
  await page.getByRole('tab', { name: 'Run' }).focus()
  await page.keyboard.press('ArrowLeft')
  assert.equal(await page.getByRole('tabpanel', { name: 'Rig' }).isVisible(), true, 'tabs by arrow keys')
  const strong = kind => page.locator(`#rig-view strong.${kind}`).allTextContents()
  for (const dark of [false, true]) {
    if (dark) await page.getByRole('button', { name: 'Dark room' }).click()
    for (const tab of ['Run', 'Sessions', 'Clouds', 'Corners', 'Rig']) {
      await page.getByRole('tab', { name: tab }).click()
      if (tab === 'Rig') {
        await page.getByRole('button', { name: 'What this machine and rig can do' }).click()
        await page.getByText('another disk').waitFor()
        assert.deepEqual([await strong('bad'), await strong('good')], [['no', 'bad', 'yes'], ['good']])
      }
      assert.deepEqual(await hardToUse(page), [], `${tab}${dark ? ', dark' : ''}`)
    }
  }
})

test('an experiment shows its plots as they come, and its report', { skip: wires && 'the simulated tank says enough' }, async () => {
  server.kill('SIGINT')
  await server.over
  const measure = '<startOn><type>onInit</type></startOn><stopOn><type>never</type></stopOn>'
  mkdirSync(join(folder, 'benchmarks'))
  writeFileSync(join(folder, 'benchmarks/levels.xml'), `<benchmark><measures><reconstruction3D detailedResultsToGlobals="true"><name>laser</name><target>object</target><topic>laser</topic><from>base</from>${measure}</reconstruction3D></measures>${measure}<function>laser.coverage</function><sceneUpdater><luxUpdater><level>30</level><level>150</level><interval>0</interval></luxUpdater></sceneUpdater></benchmark>\n`)
  await begin()
  const page = await open()
  await page.getByRole('button', { name: 'Take control' }).click()
  await page.locator('#control', { hasText: 'yours' }).waitFor()
  await page.locator('#command').selectOption('experiment')
  await page.getByLabel('Benchmark file').selectOption('levels.xml')
  await page.locator('#start').click()
  const coverage = page.getByAltText(/^coverage/).first()
  await coverage.waitFor({ timeout: 3 * patience })
  assert.match(await run(page).textContent(), /runs$/, 'a plot of the first level, while the second is recorded')
  const first = await coverage.getAttribute('src')
  await until('the end', async () => (await run(page).textContent()) === 'Experiment: done', 3 * patience)
  assert.notEqual(await coverage.getAttribute('src'), first)
  assert.ok(await coverage.evaluate(image => image.decode().then(() => image.naturalWidth > 100)))
  const later = await open()
  await later.getByAltText(/^coverage/).first().waitFor()
  await keep(page, 'console_experiment')
  await page.getByRole('button', { name: 'Look at the report' }).click()
  const report = page.frameLocator('#report-box iframe')
  await report.getByText('levels').first().waitFor()
  const frame = page.frames().find(at => at.url().endsWith('/experiments/levels/report.html'))
  await frame.evaluate(() => parent.postMessage({ open: '../../sessions/x/report.html' }, '*'))
  const [opened] = await Promise.all([page.context().waitForEvent('page'), frame.evaluate(() => document.querySelector('a[href^="sessions/"]').click())])
  await until('the session of a level', () => /\/experiments\/levels\/sessions\/\w+\/report\.html$/.test(opened.url()), 5000)
  assert.deepEqual(page.bad, [])
})

test('a scan is started, watched and looked at', async t => {
  const page = await open()
  await page.getByLabel('Operator').fill('Anna')
  await start(page, 'scan', brief)
  if (!(await sweeps(page, t))) return
  if (!(await brings(page, t, 'a growing cloud', async () => (await page.evaluate(() => window.came.length)) > 10))) return
  await page.locator('#cameras img').first().waitFor()
  assert.ok(await page.locator('#cameras img').first().evaluate(image => image.decode().then(() => image.naturalWidth > 100)))
  if (pictures) await until('half a cloud', async () => (await points(page)) > 30_000)
  await keep(page, 'console_scan')
  if (!(await brings(page, t, 'the end', async () => (await run(page).textContent()) === 'Scan: done', 2 * patience))) return
  assert.equal(await page.locator('#end').textContent(), 'Laser off, arm at rest')
  assert.match(await page.locator('#scores').textContent(), /laser0\.\d\d mm\d+\.\d %\d+\.\d %\d+\.\d\d %.*stereo/)
  assert.ok((await points(page)) > 10_000, `${await points(page)} points`)
  await until('the cloud', async () => (await coloured(page.locator('#cloud canvas'))) > 0.01, 5000)

  await keep(page, 'console_done')
  await page.getByRole('button', { name: 'Look at the session' }).click()
  await page.locator('.frames img').waitFor()
  assert.match(await page.locator('.frames').textContent(), /frame 1 of \d+, 0\.000 s; slew -?\d\.\d\d°, shoulder \d+\.\d\d°/)
  await until('a frame', () => page.locator('.frames img').evaluate(image => image.naturalWidth === 640 || image.naturalWidth > 100))
  await page.frameLocator('iframe').getByText('laser').first().waitFor()
  const report = page.frames().find(frame => frame.url().endsWith('report.html'))
  for (const file of ['../../rig/rig.yaml', 'report.html', 'http://evil.example/']) await report.evaluate(open => parent.postMessage({ open }, '*'), file)
  const [opened] = await Promise.all([page.context().waitForEvent('page'), report.getByRole('link', { name: 'results/laser.json' }).click()])
  await until('the file of a link in the report', () => opened.url().endsWith('/results/laser.json'), 5000)
  assert.equal(page.context().pages().length, 2, 'a report opens files of its session alone')
  await opened.close()
  await keep(page, 'console_sessions')
  await page.getByRole('button', { name: 'Show laser', exact: true }).click()
  await page.getByText(/, laser: \d+ points shown/).waitFor()
  await page.getByRole('tab', { name: 'Sessions' }).click()
  await page.locator('#sessions tbody button').first().click()
  await page.getByRole('button', { name: 'Show stereo', exact: true }).click()
  await page.getByText(/, stereo: \d+ points shown; mean error \d\.\d\d mm, coverage \d+\.\d %, outliers \d+\.\d\d %/).waitFor()
  for (const mode of ['verdict', 'error', 'sigma', 'cloud, each its own']) {
    await page.getByRole('button', { name: mode, exact: true }).click()
    await until(mode, async () => (await coloured(page.locator('#compare canvas'))) > 0.01, 5000)
    await keep(page, `console_clouds_${mode.split(',')[0]}`)
  }
  await state(page)
  await clickCorners(page, join(folder, 'sessions', sessions()[0]))
  await page.getByRole('tab', { name: 'Run' }).click()
  await page.getByRole('button', { name: 'Dark room' }).click()
  await keep(page, 'console_dark')
  await page.setViewportSize({ width: 800, height: 1000 })
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), true)
  assert.deepEqual(page.bad, [])
  await downloads(page, sessions()[0])
  if (wires) {
    const after = (await drawnAfter(page)).sort((a, b) => a - b)
    console.log(`from a frame's stamp to its points on the page: median ${after[after.length >> 1].toFixed(0)} ms, at most ${after.at(-1).toFixed(0)} ms, ${after.length} messages`)
    if (after.at(-1) > drawnWithin) skipIfLate(t, `points were drawn after ${after.at(-1).toFixed(0)} ms`)
  }
})

test('STOP in the sweep: the devices confirm, and the session can be read', async t => {
  const page = await open()
  await start(page)
  if (!(await sweeps(page, t))) return
  await page.evaluate(() => document.getElementById('stop').addEventListener('pointerdown', () => { window.pressed = Date.now() }, true))
  await page.getByRole('button', { name: 'STOP' }).click()
  await page.locator('#end', { hasText: 'Laser off, arm at rest' }).waitFor()
  const confirmed = Date.now()
  await until('the end', async () => (await run(page).textContent()) === 'Scan: ended in part')
  if (wires) {
    const pressed = await page.evaluate(() => window.pressed)
    const monotonic = monotonicAhead()
    const after = what => Number(events(sessions()[0]).findLast(line => line.includes(what)).split(',')[0]) / 1e6 - monotonic - pressed
    console.log(`after the click on STOP: laser commanded off ${after(',laser,off').toFixed(1)} ms, read back dark ${after(',laser,dark').toFixed(1)} ms, both confirmed on the page ${confirmed - pressed} ms`)
    if (after(',laser,off') >= stopBound) return skipIfLate(t, `the laser was commanded off after ${after(',laser,off').toFixed(1)} ms`)
  }
  assert.match(status(sessions()[0]), /^['"]?stopped/)
  await keep(page, 'console_stopped')
})

test('the space bar is STOP, wherever nobody types', async t => {
  const page = await open()
  await start(page)
  if (!(await sweeps(page, t))) return
  await page.locator('#take').focus()
  await page.keyboard.press('Space')
  await until('the end', async () => (await run(page).textContent()) === 'Scan: ended in part')
})

test('one browser is in control; any can stop', async t => {
  const page = await open()
  const other = await open(800, 900)
  await start(page)
  if (!(await sweeps(page, t))) return
  assert.equal(await other.getByRole('button', { name: 'Take control' }).isDisabled(), true)
  assert.equal(await other.locator('#start').isDisabled(), true)
  await until('the other browser\'s cloud', async () => (await points(other)) > 0)
  await other.getByRole('button', { name: 'STOP' }).click()
  await until('the end', async () => (await run(page).textContent()) === 'Scan: ended in part')
  await page.getByRole('button', { name: 'Offer control' }).click()
  await other.getByRole('button', { name: 'Take control' }).click()
  await other.locator('#control', { hasText: 'yours' }).waitFor()
  assert.equal(await page.locator('#start').isDisabled(), true)
})

test('a server that is asked for what it does not offer says no', async () => {
  const page = await open()
  const refused = await page.evaluate(async () => {
    const socket = new WebSocket(`ws://${location.host}/live`)
    const said = []
    socket.addEventListener('message', event => { if (typeof event.data === 'string') said.push(JSON.parse(event.data)) })
    await new Promise(done => socket.addEventListener('open', done))
    for (const text of ['{"do":"start","command":"scan"}', '{"do":"rig","name":"tank-wire"}', '{"do":"take"}', '{"do":"start","command":"emulate"}', '{"do":"start","command":"scan","options":{"out":"/x"}}', 'no JSON', '[]', '{"do":{}}',
      '{"do":"corners","folder":"../x","corners":[]}', '{"do":"corners"}', '{"do":"rig","name":"/etc"}'])
      socket.send(text)
    socket.send('{"do":"nothing more"}') // answered last
    const refusals = () => said.filter(message => message.is === 'refused').map(message => message.why)
    await new Promise(done => socket.addEventListener('message', () => refusals().length === 11 && done()))
    return refusals()
  })
  for (const why of refused.slice(0, 2)) assert.match(why, /not in control/)
  assert.match(refused[2], /emulate/)
  assert.match(refused[3], /out/)
  assert.match(refused[9], /rig: found '\/etc', expected one that is offered/)
  assert.equal(refused.length, 11)
  assert.deepEqual(sessions(), [])
})

test('the browser in control dies: everything stops', async t => {
  const watcher = await open()
  const own = await launch()
  const page = await (await own.newContext()).newPage()
  await page.goto(address)
  await start(page)
  if (!(await sweeps(watcher, t))) return own.close()
  await own.close()
  await until('the end', async () => (await run(watcher).textContent()) === 'Scan: ended in part')
  assert.equal(await watcher.locator('#end').textContent(), 'Laser off, arm at rest')
})

test('the server is killed or silent: the page says so within a second, and the scan stops', async t => {
  const page = await open()
  await start(page)
  if (!(await sweeps(page, t))) return
  const stale = () => page.evaluate(() => document.body.classList.contains('stale'))
  const said = async signal => {
    server.kill(signal)
    const after = await until('stale', stale, 5000)
    if (after >= 1000) skipIfLate(t, `said ${after} ms after ${signal}`)
  }
  await said('SIGSTOP')
  assert.equal(await page.locator('#connection').getAttribute('class'), 'bad')
  assert.match(await page.locator('#connection').textContent(), /^connection lost: what is shown is \d+ s old$/)
  server.kill('SIGCONT')
  await until('all is fresh', async () => !(await stale()), 5000)
  await said('SIGKILL')
  await until('the stop', () => status(sessions()[0]).includes('stopped'))
})

test('Ctrl-C ends the server after the run has stopped', async t => {
  const page = await open()
  await start(page)
  if (!(await sweeps(page, t))) return
  server.kill('SIGINT')
  assert.equal(await server.over, 0)
  assert.match(status(sessions()[0]), /^['"]?stopped/)
})

test('the guided calibration shows its pictures as they come, and says which do not count', { skip: wires && 'the simulated tank says enough' }, async () => {
  // Somebody has clamped the marker 20 cm from where the rig file has it, and covered a column of the checkerboard's squares.
  server.kill('SIGINT')
  await server.over
  rmSync(join(folder, 'rig'), { recursive: true })
  mkdirSync(join(folder, 'new'))
  smallRig(program, rig, join(folder, 'new', rig), 2)
  renameSync(join(folder, 'new', rig), join(folder, 'rig'))
  edit(join(folder, 'rig/rig.yaml'), ['pictures: 60', 'pictures: 24'], ['postures: 24', 'postures: 20'], ['from_rad: 1.3', 'from_rad: 1.5'], ['to_rad: 2.1', 'to_rad: 1.9'])
  edit(join(folder, 'rig/tank.xml'), ['<count>30</count>', '<count>12</count>'], ['<y>-0.07</y><z>0.0405</z>', '<y>-0.07</y><z>0.2405</z>'], ['<pattern>checkerboard</pattern><columns>9</columns>', '<pattern>checkerboard</pattern><columns>8</columns>'])
  await begin()

  const page = await open()
  await page.evaluate(() => { // every word of it: the next picture's come soon
    window.said = []
    const judged = document.getElementById('judged')
    new MutationObserver(() => {
      for (const figure of judged.children) {
        const words = [document.getElementById('judged-title').textContent.replace(/, picture.*/, ''), ...[...figure.querySelectorAll('figcaption, p')].map(part => part.textContent)].join(' | ')
        if (!window.said.includes(words)) window.said.push(words)
      }
    }).observe(judged, { childList: true, subtree: true })
  })
  const said = words => page.evaluate(([source]) => window.said.find(text => new RegExp(source).test(text)), [words.source])
  await start(page, 'calibrate')
  await until('a board that counts', async () => /counts: \d+ corners/.test(await page.locator('#judged').textContent()))
  await until('its pictures', () => page.locator('#judged img').evaluateAll(images => images.length === 3 && images.every(image => image.naturalWidth > 100)))
  assert.ok(await coloured(page.locator('#judged img').first()) > 0)
  assert.match(await page.locator('#judged-missing').textContent(), /^(Still missing: \d+ pictures? of the board|Enough pictures count)/)
  await keep(page, 'console_boards')
  await until('the marker', () => said(/^Marker in the gripper \| mono \| counts: \d+ points/), 3 * patience)
  await until('no marker', () => said(/^Marker in the gripper \| mono \| does not count: the marker is not found \| \d+ of 12 pictures/))
  await until('a part of a board', () => said(/^The laser's sheet \| mono \| does not count: the checkerboard was not seen whole while the arm rested: lean it where the camera sees all of it \| 0 of 6 pictures/), 3 * patience)
  assert.match(await page.locator('#judged-missing').textContent(), /^Still missing: 0 pictures of the stripe count, expected 6\./)
  assert.ok(!(await said(/^The laser's sheet \| mono \| counts/)))
  assert.ok(await said(/^Board \| left \| does not count: found /), 'a board that not all cameras see')
  await page.getByRole('button', { name: 'STOP' }).click()
  await until('the end', async () => !/ (runs|is being stopped)$/.test(await run(page).textContent()), 3 * patience)
  assert.deepEqual(page.bad, [])
})

test('jogging lasts as long as the button is held', { skip: wires && 'a scan over wires says enough' }, async () => {
  const page = await open()
  await page.getByRole('button', { name: 'Take control' }).click()
  await page.locator('#command').selectOption('jog')
  await page.locator('[name=joint]').selectOption('elbow')
  const button = page.locator('#start')
  await button.click()
  assert.equal(await page.locator('#warning').isHidden(), true, 'a field is missing: nothing was asked for')
  await page.locator('[name=angle]').fill('0.5')
  await button.hover()
  await page.mouse.down()
  await until('the end', async () => /done/.test(await run(page).textContent()))
  await page.mouse.up()
  assert.match(await page.locator('#log').textContent(), /elbow/)
})

test('STOP of what neither moves nor shines waits for no device', { skip: wires && 'a scan over wires says enough' }, async () => {
  const page = await open()
  await start(page, 'preview')
  await page.locator('#cameras img').first().waitFor()
  await page.getByRole('button', { name: 'STOP' }).click()
  await until('the end', async () => /done|in part/.test(await run(page).textContent()))
  assert.equal(await page.locator('#end').textContent(), '')
})

test('another rig is chosen: nothing of the one before is left', { skip: wires && 'the page is the same' }, async () => {
  const page = await open()
  const other = await open()
  const choice = page.locator('#rigs')
  assert.equal(await choice.isDisabled(), true, 'without control')
  await page.getByRole('button', { name: 'Take control' }).click()
  await page.getByRole('button', { name: 'Read the arm' }).first().click()
  await page.locator('#state-arm', { hasText: 'arm status' }).waitFor()
  await page.locator('#command').selectOption('park')
  await page.locator('#start').click()
  await until('the end', async () => (await run(page).textContent()) === 'Park: done')
  await choice.selectOption('lab-published')
  for (const browser of [page, other]) {
    await browser.locator('#rig', { hasText: 'lab-published' }).waitFor()
    assert.equal(await run(browser).textContent(), 'nothing runs')
    assert.match(await browser.locator('#state-arm').textContent(), /not known/)
  }
  assert.equal(await page.locator('#command').inputValue(), 'park')
  const drawn = await page.evaluate(async () => (await fetch('/api/path')).json())
  const planned = await page.evaluate(async () => (await fetch('/api/plan')).json())
  const truth = JSON.parse(execFileSync(program, ['scan', '--dry-run', '--json', '--rig', 'lab-published'], { cwd: folder, stdio: ['ignore', 'pipe', 'ignore'] }))
  for (const plan of [drawn, planned]) assert.equal(plan.clearance_m, truth.clearance_m)
  const later = await open()
  assert.equal(await later.locator('#rig').textContent(), 'lab-published')
  assert.deepEqual(page.bad, [])
})

test('a hundred watch: nothing is lost, the server stays small', async t => {
  const letIn = await answer(`/${new URL(address).search}`)
  const cookie = letIn.headers['set-cookie'][0].split(';')[0]
  const resident = () => Number(/^VmRSS:\s*(\d+)/m.exec(readFileSync(`/proc/${server.pid}/status`, 'utf8'))[1]) / 1024 // [MB]
  const cpu = () => readFileSync(`/proc/${server.pid}/stat`, 'utf8').split(' ').slice(13, 15).reduce((sum, ticks) => sum + Number(ticks) / 100, 0) // [s]
  const operator = await watch(address, cookie)
  const watchers = await Promise.all(Array.from({ length: 100 }, () => watch(address, cookie)))
  const [small, began, used] = [resident(), Date.now(), cpu()]
  operator.say({ do: 'take' })
  operator.say({ do: 'start', command: 'scan', options: brief ? { preset: brief } : {} })
  const letGo = () => [operator, ...watchers].filter(watcher => watcher.closed).length
  await until('the end', () => letGo() > 0 || Number.isInteger(operator.last('run')?.exit_code), 3 * patience)
  if (letGo() > 0) return skipIfLate(t, `${letGo()} were let go`, pingAnswered)
  assert.equal(operator.last('run').exit_code, 0, operator.texts.filter(text => text.is === 'log').map(text => text.text).join(''))
  await until('the last message', () => letGo() > 0 || watchers.every(watcher => watcher.last('run')?.exit_code === 0), 5000)
  if (letGo() > 0) return skipIfLate(t, `${letGo()} were let go`, pingAnswered)
  assert.ok(operator.points > 10_000, `${operator.points} points`)
  for (const watcher of watchers) {
    assert.equal(watcher.closed, false)
    assert.equal(watcher.points, operator.points)
    assert.equal(watcher.last('feed')?.is, 'feed')
  }
  const grown = resident() - small
  console.log(`100 watchers: ${(100 * (cpu() - used) / ((Date.now() - began) / 1000)).toFixed(1)} % of a processor, ${small.toFixed(0)} MB and ${grown.toFixed(0)} MB more at the end`)
  assert.ok(grown < 100, `the server grew by ${grown} MB`)
  for (const watcher of [operator, ...watchers]) watcher.end()
})

test('the rig is asked for its state', async () => {
  const page = await open()
  await page.getByRole('tab', { name: 'Rig' }).click()
  for (const [button, sign] of [['Read the arm', 'angle deg'], ['The scan that is planned', 'sweep pass 0'], ['What this machine and rig can do', 'verdict']]) {
    await page.getByRole('button', { name: button }).click()
    await page.locator('#rig-view').getByText(sign).first().waitFor({ timeout: 60_000 })
  }
  await keep(page, 'console_rig')
  assert.deepEqual(page.bad, [])
})
