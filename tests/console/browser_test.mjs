// The console as an operator meets it: `tankrig serve` and a browser. Arguments: rig, program, folder with node_modules,
// browser. TANKRIG_PICTURES=FOLDER keeps pictures of the pages.
import assert from 'node:assert/strict'
import { execFileSync, spawn } from 'node:child_process'
import { cpSync, existsSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync } from 'node:fs'
import http from 'node:http'
import { createRequire } from 'node:module'
import { tmpdir } from 'node:os'
import { monitorEventLoopDelay } from 'node:perf_hooks'
import { join } from 'node:path'
import { after, afterEach, before, beforeEach, test } from 'node:test'

import { smallRig, until as within } from './small_rig.mjs'
import { watch } from './watcher.mjs'

const [rig, program, web, executablePath] = process.argv.slice(2)
const { chromium } = createRequire(join(web, 'package.json'))('playwright-core')
const wires = rig !== 'tank-sim'
const patience = wires ? 120_000 : 60_000 // [ms] for a whole scan
const mostLate = 50 // [ms] that this process may wake late where the clock judges
const stopBound = 100 // [ms] from a click to the laser's command, on loopback
const pictures = process.env.TANKRIG_PICTURES

const until = (what, condition, milliseconds = patience) => within(what, condition, milliseconds)

let browser, folder, server, address, small

const launch = () => chromium.launch({ executablePath, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'] })

/** A process, and what it printed. */
function serve() {
  const child = spawn(program, ['serve', '--rig', join(folder, 'rig'), '--port', '0'], { cwd: folder, stdio: ['ignore', 'pipe', 'pipe'] })
  child.said = ''
  for (const stream of [child.stdout, child.stderr]) stream.on('data', data => { child.said += data })
  child.over = new Promise(done => child.on('exit', code => done(code)))
  return child
}

const open = async (width = 1280, height = 900) => {
  const context = await browser.newContext({ viewport: { width, height } })
  const page = await context.newPage()
  page.bad = []
  page.on('pageerror', error => page.bad.push(String(error)))
  page.on('console', message => { if (message.type() === 'error') page.bad.push(message.text()) })
  await page.goto(address)
  await page.getByText('connected', { exact: true }).waitFor()
  return page
}

const keep = async (page, name) => { if (pictures) await page.screenshot({ path: join(pictures, `${name}.png`), fullPage: true }) }
const points = async page => Number((await page.locator('#cloud-says').textContent()).split(' ')[0] || 0)
const run = page => page.locator('#run-state')
const sessions = () => (existsSync(join(folder, 'sessions')) ? readdirSync(join(folder, 'sessions')).filter(name => name.includes('-2')) : [])
const events = name => readFileSync(join(folder, 'sessions', name, 'events.csv'), 'utf8').trim().split('\n').slice(1)
const status = name => /^status: (.*)$/m.exec(readFileSync(join(folder, 'sessions', name, 'session.yaml'), 'utf8'))?.[1] ?? ''

async function start(page, command = 'scan') {
  await page.getByRole('button', { name: 'Take control' }).click()
  await page.locator('#control', { hasText: 'yours' }).waitFor()
  await page.locator('#command').selectOption(command)
  await page.locator('#start').click()
}
const witness = monitorEventLoopDelay({ resolution: 5 })

/** Where something was late: skips if this process was, too, and fails if it was not. */
function skipIfLate(t, what) {
  const late = witness.max / 1e6
  assert.ok(late > mostLate, `${what}; this process woke at most ${late.toFixed(1)} ms late`)
  t.skip(`${what}: skipped because the machine was late: by ${late.toFixed(1)} ms, at most ${mostLate.toFixed(1)} ms allowed`)
}

/** Waits for the sweep. In virtual time it always comes; over wires a machine that is late may end the scan before. */
async function sweeps(page, t) {
  await until('the sweep', async () => (await points(page)) > 0 || / (done|ended in part|failed)/.test(await run(page).textContent()))
  if ((await points(page)) > 0) return true
  const said = await page.locator('#log').textContent()
  assert.ok(wires, said)
  skipIfLate(t, said.trim().split('\n').pop())
  return false
}

before(async () => {
  browser = await launch()
  small = smallRig(program, rig, join(mkdtempSync(join(tmpdir(), 'tankrig-test-')), rig)) // its folder gives it its name
})
after(async () => {
  await browser.close()
  rmSync(join(small, '..'), { recursive: true, force: true })
})
beforeEach(async () => {
  folder = mkdtempSync(join(tmpdir(), 'tankrig-test-'))
  cpSync(small, join(folder, 'rig'), { recursive: true })
  server = serve()
  witness.enable()
  witness.reset()
  await until('the address', () => /http:\S+/.test(server.said) || server.exitCode !== null, 10_000)
  address = /http:\S+/.exec(server.said)?.[0]
  assert.ok(address, server.said)
})
afterEach(async () => {
  for (const context of browser.contexts()) await context.close()
  if (server.exitCode === null && server.signalCode === null) server.kill('SIGINT')
  await server.over
  rmSync(folder, { recursive: true, force: true })
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

/** A cloud as CSV and PLY: what arrives is what lies on the disk. */
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
  await keep(page, 'console_corners')
  await page.getByRole('button', { name: 'Save the corners' }).click()
  await page.getByText('Saved as').waitFor()
  const found = JSON.parse(execFileSync(program, ['calibrate', 'object', '--corners', join(place, 'corners.yaml'), '--image', join(place, 'object.png'),
    '--camera', join(session, 'cameras/mono.yaml'), '--object', join(session, 'black_box.obj'), '--json'], { stdio: ['ignore', 'pipe', 'ignore'] }))
  assert.ok(found.raw_rms_px < 1, `the clicks err by ${found.raw_rms_px} px`)
  assert.equal(found.corners.length, seen.length)
}

test('a scan is started, watched and looked at', async t => {
  const page = await open()
  await start(page)
  if (!(await sweeps(page, t))) return
  const first = await points(page)
  await until('a growing cloud', async () => (await points(page)) > first + 1000)
  await page.locator('#cameras img').first().waitFor()
  assert.ok(await page.locator('#cameras img').first().evaluate(image => image.decode().then(() => image.naturalWidth > 100)))
  if (pictures) await until('half a cloud', async () => (await points(page)) > 30_000)
  await keep(page, 'console_scan')
  await until('the end', async () => (await run(page).textContent()) === 'Scan: done', 2 * patience)
  assert.equal(await page.locator('#end').textContent(), 'Laser off, arm at rest')
  assert.ok((await points(page)) > 10_000, `${await points(page)} points`)
  await until('the cloud', async () => (await coloured(page.locator('#cloud canvas'))) > 0.05, 5000)

  await page.getByRole('tab', { name: 'Sessions' }).click()
  await page.locator('#sessions tbody button').first().click()
  await page.locator('.frames img').waitFor()
  await until('a frame', () => page.locator('.frames img').evaluate(image => image.naturalWidth === 640 || image.naturalWidth > 100))
  await page.frameLocator('iframe').getByText('laser').first().waitFor()
  await keep(page, 'console_sessions')
  await page.getByRole('button', { name: 'Show laser', exact: true }).click()
  await page.getByText(/, laser: \d+ points shown/).waitFor()
  await page.getByRole('tab', { name: 'Sessions' }).click()
  await page.locator('#sessions tbody button').first().click()
  await page.getByRole('button', { name: 'Show stereo', exact: true }).click()
  await page.getByText(/, stereo: \d+ points shown/).waitFor()
  for (const mode of ['verdict', 'error', 'sigma', 'cloud, each its own']) {
    await page.getByRole('button', { name: mode, exact: true }).click()
    await until(mode, async () => (await coloured(page.locator('#compare canvas'))) > 0.01, 5000)
    await keep(page, `console_clouds_${mode.split(',')[0]}`)
  }
  await clickCorners(page, join(folder, 'sessions', sessions()[0]))
  await page.setViewportSize({ width: 800, height: 1000 })
  await keep(page, 'console_sessions_800')
  await page.getByRole('tab', { name: 'Run' }).click()
  await page.getByRole('button', { name: 'Dark room' }).click()
  await keep(page, 'console_dark_800')
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), true)
  assert.deepEqual(page.bad, [])
  await downloads(page, sessions()[0])
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
    const monotonic = Number(process.hrtime.bigint()) / 1e6 - Date.now() // of the session's stamps, less this clock's [ms]
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
    for (const text of ['{"do":"start","command":"scan"}', '{"do":"take"}', '{"do":"start","command":"emulate"}', '{"do":"start","command":"scan","options":{"out":"/x"}}', 'no JSON', '[]', '{"do":{}}',
      '{"do":"corners","folder":"../x","corners":[]}', '{"do":"corners"}'])
      socket.send(text)
    socket.send('{"do":"nothing more"}') // answered last
    const refusals = () => said.filter(message => message.is === 'refused').map(message => message.why)
    await new Promise(done => socket.addEventListener('message', () => refusals().length === 9 && done()))
    return refusals()
  })
  assert.match(refused[0], /not in control/)
  assert.match(refused[1], /emulate/)
  assert.match(refused[2], /out/)
  assert.equal(refused.length, 9)
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

test('the server is killed: the page says so within a second and a half, and the scan stops', async t => {
  const page = await open()
  await start(page)
  if (!(await sweeps(page, t))) return
  server.kill('SIGKILL')
  const after = await until('stale', () => page.evaluate(() => document.body.classList.contains('stale')), 5000)
  if (after >= 1500) skipIfLate(t, `said after ${after} ms`)
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

test('jogging lasts as long as the button is held', { skip: wires && 'a scan over wires says enough' }, async () => {
  const page = await open()
  await page.getByRole('button', { name: 'Take control' }).click()
  await page.locator('#command').selectOption('jog')
  await page.locator('[name=joint]').selectOption('elbow')
  await page.locator('[name=angle]').fill('0.5')
  const button = page.locator('#start')
  await button.hover()
  await page.mouse.down()
  await until('the end', async () => /done/.test(await run(page).textContent()))
  await page.mouse.up()
  assert.match(await page.locator('#log').textContent(), /elbow/)
})

test('a hundred watch: nothing is lost, the server stays small', async () => {
  const letIn = await answer(`/${new URL(address).search}`)
  const cookie = letIn.headers['set-cookie'][0].split(';')[0]
  const resident = () => Number(/^VmRSS:\s*(\d+)/m.exec(readFileSync(`/proc/${server.pid}/status`, 'utf8'))[1]) / 1024 // [MB]
  const cpu = () => readFileSync(`/proc/${server.pid}/stat`, 'utf8').split(' ').slice(13, 15).reduce((sum, ticks) => sum + Number(ticks) / 100, 0) // [s]
  const operator = await watch(address, cookie)
  const watchers = await Promise.all(Array.from({ length: 100 }, () => watch(address, cookie)))
  const [small, began, used] = [resident(), Date.now(), cpu()]
  operator.say({ do: 'take' })
  operator.say({ do: 'start', command: 'scan', options: {} })
  await until('the end', () => Number.isInteger(operator.last('run')?.exit_code), 3 * patience)
  assert.equal(operator.last('run').exit_code, 0, operator.texts.filter(text => text.is === 'log').map(text => text.text).join(''))
  await until('the last message', () => watchers.every(watcher => watcher.last('run')?.exit_code === 0), 5000)
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
