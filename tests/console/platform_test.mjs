// The benchmark platform as its submitters meet it: good, bad and hostile uploads, a killed server, many at a time.
// Arguments: rig, program, folder with node_modules, browser. TANKRIG_LOAD_S=60 makes the load's 5 s longer.
import assert from 'node:assert/strict'
import { execFileSync, spawn, spawnSync } from 'node:child_process'
import { chmodSync, cpSync, existsSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, symlinkSync, writeFileSync } from 'node:fs'
import http from 'node:http'
import net from 'node:net'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import { after, before, test } from 'node:test'

import { launchBrowser } from './browser.mjs'
import { keep, pictures } from './pictures.mjs'
import { smallRig, until as within, wholeRig } from './small_rig.mjs'

const [rig, program, web, executablePath] = process.argv.slice(2)
const makeRig = pictures ? wholeRig : smallRig
const loadSeconds = Number(process.env.TANKRIG_LOAD_S ?? 5)
const patience = 240_000 // [ms] for what is scored

let folder, sessions, scratch, good, platform

const until = (what, condition, milliseconds = patience) => within(what, condition, milliseconds)

const pause = milliseconds => new Promise(done => setTimeout(done, Math.max(0, milliseconds)))

/** `tankrig serve --platform`, and how to ask it. */
class Server {
  constructor(store, ...options) {
    this.begin(store, program, ['serve', '--platform', '--datasets', sessions, '--store', store, '--port', '0', ...options])
  }
  begin(store, command, words) {
    this.store = store
    this.child = spawn(command, words, { cwd: folder, stdio: ['ignore', 'pipe', 'pipe'], env: { ...process.env, TMPDIR: scratch } })
    this.said = ''
    for (const stream of [this.child.stdout, this.child.stderr]) stream.on('data', data => { this.said += data })
    this.over = new Promise(done => this.child.on('exit', done))
  }
  async ready() {
    await until('the address', () => /http:\S+/.test(this.said) || this.child.exitCode !== null)
    const address = /http:\S+/.exec(this.said)?.[0]
    assert.ok(address, this.said)
    this.address = address
    this.port = Number(new URL(address).port)
    this.key = new URL(address).searchParams.get('key')
    return this
  }
  async end(signal = 'SIGINT') {
    if (this.child.exitCode === null && this.child.signalCode === null) this.child.kill(signal)
    await this.over
  }
  request(method, path, body = '', headers = {}) {
    return new Promise((done, failed) => {
      const request = http.request({ host: '127.0.0.1', port: this.port, method, path, headers: { Authorization: `Bearer ${this.key}`, 'Content-Length': Buffer.byteLength(body), ...headers } }, response => {
        const parts = []
        response.on('data', part => parts.push(part))
        response.on('error', failed)
        response.on('end', () => done({ status: response.statusCode, headers: response.headers, text: Buffer.concat(parts).toString() }))
      })
      request.on('error', failed)
      request.end(body)
    })
  }
  get(path) { return this.request('GET', path) }
  async json(path) {
    const reply = await this.get(path)
    assert.equal(reply.status, 200, reply.text)
    return JSON.parse(reply.text)
  }
  post(kind, body, query = {}, headers = {}) {
    const words = Object.entries({ dataset: 'tank', name: 'a cloud', ...query }).map(([k, v]) => `${k}=${encodeURIComponent(v)}`).join('&')
    return this.request('POST', `/api/${kind}?${words}`, body, headers)
  }
  /** Sends it, waits for its end. */
  async scored(kind, body, query) {
    const reply = await this.post(kind, body, query)
    assert.equal(reply.status, 202, reply.text)
    const { score } = JSON.parse(reply.text)
    let now
    await until('a score', async () => ['done', 'failed'].includes((now = await this.json(score)).state))
    return now
  }
  /** Of the processors' time so far [s]. */
  processor() { return readFileSync(`/proc/${this.child.pid}/stat`, 'utf8').split(') ').pop().split(' ').slice(11, 13).reduce((sum, ticks) => sum + Number(ticks) / 100, 0) }
  memory() { return Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${this.child.pid}/status`, 'utf8'))[1]) / 1024 }
}

const script = text => `#!/bin/sh\n${text}\n`
const xml = (extra = '') => `<algorithm><name>mine</name><program>run</program><uses>laser</uses><timeLimit>20</timeLimit>${extra}</algorithm>\n`

/** A .tar.gz of files by name; `make` may add what is no file. */
function archive(files, make = () => {}) {
  const place = mkdtempSync(join(folder, 'archive-'))
  for (const [name, text] of Object.entries(files)) {
    mkdirSync(join(place, name, '..'), { recursive: true })
    writeFileSync(join(place, name), text)
    if (name.endsWith('run')) chmodSync(join(place, name), 0o755)
  }
  make(place)
  return execFileSync('tar', ['-C', place, '-czf', '-', '.'], { maxBuffer: 1 << 28 })
}

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'tankrig-test-'))
  chmodSync(folder, 0o755)
  sessions = join(folder, 'sessions')
  mkdirSync(scratch = join(folder, 'scratch'))
  makeRig(program, rig, join(folder, rig))
  execFileSync(program, ['scan', ...(pictures ? [] : ['--preset', 'short']), '--rig', join(folder, rig)], { cwd: folder, stdio: 'ignore' })
  cpSync(join(sessions, readdirSync(sessions)[0]), join(sessions, 'tank'), { recursive: true })
  rmSync(join(sessions, readdirSync(sessions).find(name => name !== 'tank')), { recursive: true })
  good = readFileSync(join(sessions, 'tank', 'clouds', 'laser.ply'))
  platform = new Server(join(folder, 'store'), ...(pictures ? [] : ['--uploads-per-hour', '1000', '--waiting', '1000', '--jobs', '2']))
  await platform.ready()
})
after(async () => {
  await platform?.end()
  rmSync(folder, { recursive: true, force: true })
})

const withoutSandbox = () => /algorithms are refused: .*/.exec(platform.said)?.[0]

test('a cloud is queued, scored and ranked, with everything behind its figures', async () => {
  const score = await platform.scored('clouds', good, { name: 'ours' })
  assert.equal(score.state, 'done', score.message)
  const session = JSON.parse(readFileSync(join(sessions, 'tank', 'results', 'laser.json'), 'utf8'))
  assert.ok(Math.abs(score.figures.mean_error_m - session.mean_error_m) < 1e-6)
  assert.equal(score.figures.coverage, session.coverage)
  const [low, high] = score.figures.mean_error_interval_m
  assert.ok(low < score.figures.mean_error_m && score.figures.mean_error_m < high)
  const { behind } = score.score
  assert.equal(behind.upload_sha256, execFileSync('sha256sum', { input: good }).toString().slice(0, 64))
  const names = score.files.map(f => f.split('/').pop())
  for (const name of ['cloud.ply', 'verdict.ply', 'score.json', 'report.html', 'distances.png']) assert.ok(names.includes(name), name)
  const cloud = await platform.get(`/files/${score.id}/cloud.ply`)
  assert.equal(cloud.headers['content-disposition'], 'attachment; filename="cloud.ply"')
  assert.equal(cloud.headers['x-content-type-options'], 'nosniff')
  const report = await platform.get(`/files/${score.id}/report.html`)
  assert.match(report.headers['content-security-policy'], /^sandbox allow-scripts; default-src 'none'/)
  const board = await platform.json('/api/datasets/tank')
  assert.ok(board.best.some(s => s.id === score.id))
})

test('the dataset that is offered has the pictures and not the object', async () => {
  const { datasets } = await platform.json('/api/platform')
  assert.equal(datasets[0].download, '/datasets/tank.tar')
  const whole = await new Promise((done, failed) => http.get({ host: '127.0.0.1', port: platform.port, path: datasets[0].download, headers: { Authorization: `Bearer ${platform.key}` } }, response => {
    const parts = []
    response.on('data', part => parts.push(part)).on('end', () => done(Buffer.concat(parts))).on('error', failed)
  }))
  const names = execFileSync('tar', ['-tf', '-'], { input: whole, maxBuffer: 1 << 26 }).toString().split('\n')
  assert.ok(names.includes('tank/session.yaml') && names.includes('tank/frames.csv') && names.some(n => /frames\/.*\.png$/.test(n)))
  assert.ok(!names.some(n => /\.(obj|stl)$/.test(n)), 'a mesh')
})

test('clouds that are none fail with a reason, and nothing else does', async () => {
  const header = n => `ply\nformat ascii 1.0\nelement vertex ${n}\nproperty float x\nproperty float y\nproperty float z\nend_header\n`
  for (const [body, why] of [
    ['MZ\x90\0 no cloud at all', /cloud\.pcd/],
    [good.subarray(0, good.length / 2), /cloud\.ply/],
    [header(4_000_000_000) + '0 0 0\n', /cloud\.ply/],
    [header(2) + 'nan nan nan\nnan nan nan\n', /none of its 2 points is finite/],
    [header(1).replace('ascii 1.0\n', 'ascii 1.0\ncomment frame o\n') + '0 0 0\n', /in the frame o, expected b/],
    ['ply\n' + 'x'.repeat(200_000), /cloud\.ply/],
  ]) {
    const score = await platform.scored('clouds', body, { name: 'bad' })
    assert.equal(score.state, 'failed', JSON.stringify(score))
    assert.match(score.message, why)
    assert.ok(!score.message.includes(folder), score.message)
  }
  const far = await platform.scored('clouds', header(1) + '0 0 0.5\n', { name: 'one point' })
  assert.equal(far.state, 'done', far.message)
  assert.equal(far.figures.mean_error_m, null)
})

test('requests that ask for too much, or for nothing, are refused before their body is read', async () => {
  const declared = await new Promise((done, failed) => {
    const socket = net.connect(platform.port, '127.0.0.1')
    let said = ''
    socket.on('data', data => { said += data }).on('end', () => done(said)).on('error', failed)
    socket.write(`POST /api/clouds?dataset=tank&name=big HTTP/1.1\r\nHost: 127.0.0.1:${platform.port}\r\nAuthorization: Bearer ${platform.key}\r\nContent-Length: 10737418240\r\n\r\nply\n`)
  })
  assert.match(declared, /^HTTP\/1.1 413 /)
  assert.match(declared, /Found 10737418240 bytes, expected at most 268435456/)
  for (const [query, status, why] of [[{ dataset: '../tank' }, 400, /published/], [{ name: '' }, 400, /name/], [{ name: 'x'.repeat(61) }, 400, /name/], [{ name: 'a\nb' }, 400, /name/], [{ uses: 'sonar' }, 400, /laser or stereo/]]) {
    const reply = await platform.post('clouds', good, query)
    assert.equal(reply.status, status)
    assert.match(reply.text, why)
  }
  assert.equal((await platform.post('clouds', '')).status, 400)
  assert.equal((await platform.post('shells', good)).status, 404)
  assert.equal((await platform.post('clouds', good, {}, { Authorization: 'Bearer 0' })).status, 403)
  assert.equal((await platform.post('clouds', good, {}, { Origin: 'http://evil.example' })).status, 403)
  assert.equal((await platform.get('/files/../platform.db')).status, 404)
  assert.equal((await platform.get('/files/..%2fplatform.db')).status, 404)
  assert.equal((await platform.get('/submissions/<script>')).status, 200) // the page, which asks and is told
  const leftovers = readdirSync(platform.store).filter(name => name.endsWith('.tmp'))
  assert.deepEqual(leftovers, [])
})

test('an upload that is cut off leaves nothing', async () => {
  const before = (await platform.json('/api/datasets/tank')).newest.length
  await new Promise((done, failed) => {
    const socket = net.connect(platform.port, '127.0.0.1')
    socket.on('error', failed).on('close', done)
    socket.write(`POST /api/clouds?dataset=tank&name=cut HTTP/1.1\r\nHost: 127.0.0.1:${platform.port}\r\nAuthorization: Bearer ${platform.key}\r\nContent-Length: 100000\r\n\r\nply\n`, () => socket.destroy())
  })
  await until('the file is gone', () => !readdirSync(platform.store).some(name => name.endsWith('.tmp')), 10_000)
  assert.equal((await platform.json('/api/datasets/tank')).newest.length, before)
})

test('an algorithm runs in the sandbox, and reaches nothing there', async t => {
  if (withoutSandbox()) return t.skip(`skipped: ${withoutSandbox()}`)
  const leaks = ['test -e /etc/passwd', `test -e ${folder}/sessions`, 'echo x >> "$1/frames.csv"', 'touch /usr/x', 'python3 -c "import socket; socket.create_connection((\'127.0.0.1\', PORT), 1)"'.replace('PORT', platform.port), 'test -e "$1/box.obj"']
  const nosy = script(`${leaks.map((leak, i) => `if ${leak} 2>/dev/null; then echo leak ${i}; exit 9; fi`).join('\n')}\ntest -s "$1/frames.csv" || exit 8\necho it ran\ncp "$(dirname "$0")/ready.ply" "$2"`)
  const score = await platform.scored('algorithms', archive({ run: nosy, 'algorithm.xml': xml(), 'ready.ply': good }), { name: 'nosy' })
  assert.equal(score.state, 'done', score.message)
  assert.equal(score.kind, 'algorithm')
  assert.match((await platform.get(`/files/${score.id}/log.txt`)).text, /it ran\n$/)
  const ours = (await platform.json('/api/datasets/tank')).best.find(s => s.name === 'ours')
  assert.equal(score.figures.mean_error_m, ours.figures.mean_error_m)
})

test('algorithms that are hostile fail with a reason', async t => {
  if (withoutSandbox()) return t.skip(`skipped: ${withoutSandbox()}`)
  const run = text => archive({ run: script(text), 'algorithm.xml': xml('<processLimit>32</processLimit><memoryLimit>256</memoryLimit><diskLimit>16</diskLimit>') })
  for (const [name, body, why] of [
    ['fork bomb', run('b() { b | b & }; b; sleep 30'), /processes|ran longer|exit code/],
    ['hangs', archive({ run: script('trap "" TERM; sleep 600'), 'algorithm.xml': xml().replace('20', '2') }), /ran longer than 2 s/],
    ['disk', run('dd if=/dev/zero of=big bs=1M count=100'), /exit code|wrote more/],
    ['memory', run(`python3 -c "x = 'x' * (1 << 30)"`), /exit code 1|memory/],
    ['no cloud', run('true'), /wrote no cloud/],
    ['a link as cloud', run('ln -s /proc/self/environ "$2"'), /cloud\.ply/],
    ['html', run('echo "<script>alert(1)</script>"; exit 4'), /exit code 4: <script>/],
    ['symlink', archive({ 'algorithm.xml': xml() }, place => symlinkSync('/bin/sh', join(place, 'run'))), /'\.\/run' is a symbolic link/],
    ['outside', execFileSync('tar', ['-C', '/', '-Pczf', '-', '/etc/hostname']), /leads outside/],
    ['zip bomb', archive({ run: script('true'), 'algorithm.xml': xml() }, place => execFileSync('truncate', ['-s', '400M', join(place, 'zeros')])), /more than 256 MiB/],
    ['program of ours', archive({ 'algorithm.xml': xml().replace('>run<', '>/bin/sh<') }), /expected an executable file of the archive/],
    ['entities', archive({ run: script('true'), 'algorithm.xml': `<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><algorithm><name>&x;</name></algorithm>` }), /algorithm\.xml/],
    ['no archive', good, /archive/],
    ['<b>name</b>', archive({ run: script('exit 3'), 'algorithm.xml': xml(), '<img src=x onerror=alert(1)>': '' }), /exit code 3/],
  ]) {
    const score = await platform.scored('algorithms', body, { name })
    assert.equal(score.state, 'failed', `${name}: ${JSON.stringify(score)}`)
    assert.match(score.message, why, name)
    assert.ok(!score.message.includes(tmpdir()), score.message)
  }
  assert.deepEqual(readdirSync(scratch), [])
})

test('nobody takes more than a share', async () => {
  const small = await new Server(join(folder, 'small'), '--uploads-per-hour', '3', '--waiting', '100').ready()
  try {
    for (let i = 0; i < 3; ++i) assert.equal((await small.post('clouds', good)).status, 202)
    const refused = await small.post('clouds', good)
    assert.equal(refused.status, 429)
    assert.match(refused.text, /3 uploads within an hour/)
    assert.ok(Number(refused.headers['retry-after']) > 3000)
  } finally {
    await small.end()
  }
  const waiting = await new Server(join(folder, 'waiting'), '--waiting', '2').ready()
  try {
    const replies = await Promise.all([1, 2, 3, 4, 5].map(() => waiting.post('clouds', good)))
    assert.ok(replies.filter(r => r.status === 429).length >= 2, replies.map(r => r.status).join())
  } finally {
    await waiting.end()
  }
})

test('so many uploads are on their way at a time, the next is told to wait', async () => {
  const most = 128
  const many = await new Server(join(folder, 'many'), '--uploads-per-hour', '1000', '--waiting', '1000').ready()
  const onTheirWay = () => readdirSync(many.store).filter(name => name.endsWith('.tmp')).length
  try {
    const sockets = Array.from({ length: most }, (_, i) => {
      const socket = net.connect(many.port, '127.0.0.1')
      socket.on('error', () => {}) // it is cut off below
      socket.write(`POST /api/clouds?dataset=tank&name=${i} HTTP/1.1\r\nHost: 127.0.0.1:${many.port}\r\nAuthorization: Bearer ${many.key}\r\nContent-Length: ${good.length}\r\n\r\n`)
      socket.write(good.subarray(0, 100))
      return socket
    })
    await until('all are on their way', () => onTheirWay() === most)
    const refused = await many.post('clouds', good)
    assert.equal(refused.status, 503)
    assert.match(refused.text, /Too many uploads at a time/)
    assert.ok(Number(refused.headers['retry-after']) > 0)
    const first = new Promise(done => sockets[0].once('data', data => done(data.toString())))
    sockets[0].write(good.subarray(100))
    assert.match(await first, /^HTTP\/1.1 202 /)
    await until('room for one', () => onTheirWay() === most - 1)
    assert.equal((await many.post('clouds', good)).status, 202)
    for (const socket of sockets) socket.destroy()
    await until('the others are forgotten', () => onTheirWay() === 0)
    assert.equal((await many.json('/api/datasets/tank')).newest.length, 2)
  } finally {
    await many.end()
  }
})

test('a disk that is nearly full takes nothing more, and says so', async t => {
  const place = join(folder, 'small-disk')
  mkdirSync(place)
  const own = process.geteuid() === 0 ? '-m' : '-rm'
  if (spawnSync('unshare', [own, 'mount', '-t', 'tmpfs', 'small', place]).status !== 0) return t.skip('skipped: this machine permits no mount of one\'s own')
  const full = Object.create(Server.prototype)
  full.begin(place, 'unshare', [own, 'sh', '-c', 'mount -t tmpfs -o size=2000m small "$1" && shift && exec "$@"', 'sh', place, program, 'serve', '--platform', '--datasets', sessions, '--store', place, '--port', '0'])
  await full.ready()
  try {
    const refused = await full.post('clouds', good)
    assert.equal(refused.status, 507)
    assert.match(refused.text, /disk is full/)
    assert.equal((await full.json('/api/datasets/tank')).newest.length, 0)
  } finally {
    await full.end()
  }
})

test('what scores an upload has limits of its own, and gives way to the server', async () => {
  const limited = () => readdirSync('/proc').filter(name => /^\d+$/.test(name)).some(name => {
    try {
      if (!readFileSync(`/proc/${name}/cmdline`, 'utf8').includes(`serve\0score\0${join(sessions, 'tank')}\0`)) return false
      const nice = Number(readFileSync(`/proc/${name}/stat`, 'utf8').split(') ').pop().split(' ')[16])
      return /Max address space +8589934592 +8589934592/.test(readFileSync(`/proc/${name}/limits`, 'utf8')) && nice === 10
    } catch {
      return false // it has just ended
    }
  })
  const replies = await Promise.all([1, 2, 3, 4].map(i => platform.post('clouds', good, { name: `limits ${i}` })))
  for (const reply of replies) assert.equal(reply.status, 202, reply.text)
  await until('the limits', limited)
  for (const reply of replies) await until('its score', async () => (await platform.json(JSON.parse(reply.text).score)).state === 'done')
})

test('a server that is killed with a queue goes on with it', async () => {
  const store = join(folder, 'killed')
  let server = await new Server(store).ready()
  const ids = []
  for (let i = 0; i < 5; ++i) ids.push(JSON.parse((await server.post('clouds', good, { name: `number ${i}` })).text).id)
  await until('one runs', async () => (await server.json(`/api/submissions/${ids[0]}`)).state !== 'queued')
  await server.end('SIGKILL')
  server = await new Server(store).ready()
  try {
    for (const id of ids) {
      let now
      await until(id, async () => ['done', 'failed'].includes((now = await server.json(`/api/submissions/${id}`)).state))
      assert.equal(now.state, 'done', now.message)
    }
    assert.equal((await server.json('/api/datasets/tank')).best.length, ids.length)
  } finally {
    await server.end()
  }
})

test('twenty uploads a second beside a hundred watchers: none is lost, and memory stays flat', async t => {
  const store = join(folder, 'load')
  const options = ['--uploads-per-hour', '100000', '--waiting', '100000']
  let server = await new Server(store, ...options).ready()
  try {
    const points = Array.from({ length: 300 }, (_, i) => `${0.001 * i} 0 0.5`).join('\n')
    const small = i => `ply\nformat ascii 1.0\ncomment number ${i}\nelement vertex 300\nproperty float x\nproperty float y\nproperty float z\nend_header\n${points}\n`
    let over = false
    const looks = [], memory = [], replies = [] // looks, and answers to uploads, by how long they took [ms]
    const watchers = Array.from({ length: 100 }, async (_, i) => {
      await pause(20 * i)
      while (!over) {
        const begin = Date.now()
        const { status } = await server.get('/api/datasets/tank').catch(error => ({ status: String(error) }))
        looks.push({ status, took: Date.now() - begin })
        await pause(2000)
      }
    })
    const begin = Date.now(), used = server.processor()
    for (let i = 0; i < 20 * loadSeconds; ++i) {
      await pause(begin + 50 * i - Date.now())
      const sent = Date.now()
      const answer = server.post('clouds', small(i), { name: `load ${i}` }).catch(error => ({ status: 0, text: String(error) }))
      replies.push(answer.then(reply => ({ ...reply, took: Date.now() - sent })))
      if (i % 20 === 19) memory.push(server.memory())
    }
    const sending = (Date.now() - begin) / 1000, busy = (server.processor() - used) / sending
    const all = await Promise.all(replies)
    over = true
    await Promise.all(watchers)
    const longest = list => Math.max(...list.map(one => one.took))
    const [first, quarter, end] = [memory[0], memory[Math.floor(memory.length / 4)], memory.at(-1)]
    t.diagnostic(`${all.length} uploads in ${sending.toFixed(1)} s, the slowest answered after ${longest(all)} ms; ${looks.length} looks, the slowest after ${longest(looks)} ms; ${(100 * busy).toFixed(0)} % of a processor; memory ${first.toFixed(1)}, after a quarter ${quarter.toFixed(1)}, at the end ${end.toFixed(1)} MiB`)
    const lost = all.filter(reply => reply.status !== 202)
    assert.equal(lost.length, 0, `${lost.length} of ${all.length}: ${lost[0]?.status} ${lost[0]?.text}`)
    assert.deepEqual(looks.filter(look => look.status !== 200), [])
    assert.ok(looks.length >= 100 * Math.floor(loadSeconds / 3), `${looks.length} looks`)
    assert.ok(sending < 1.1 * loadSeconds + 1, `the uploads were ${sending} s on their way: this is no load of 20 a second`)
    assert.ok(end < quarter + 8, `memory grew from ${quarter} to ${end} MiB`)

    await server.end('SIGKILL') // what has been answered is on the disk, byte by byte
    server = await new Server(store, ...options).ready()
    const ids = all.map(reply => JSON.parse(reply.text).id)
    assert.equal(new Set(ids).size, ids.length)
    for (const [i, id] of ids.entries()) {
      await pause(6) // one address may ask 200 times a second
      assert.equal((await server.json(`/api/submissions/${id}`)).name, `load ${i}`)
      assert.equal(readFileSync(join(store, 'submissions', id, 'cloud.ply'), 'utf8'), small(i))
    }
  } finally {
    await server.end()
  }
})

/** Another's cloud: every `step`th point, moved by up to `wrong` metres along z. */
function worse(cloud, step, wrong) {
  const text = cloud.toString('latin1')
  const begin = text.indexOf('end_header\n') + 11
  const points = Number(/element vertex (\d+)/.exec(text)[1]), size = (cloud.length - begin) / points
  const kept = []
  for (let i = 0; i < points; i += step) {
    const point = Buffer.from(cloud.subarray(begin + i * size, begin + (i + 1) * size))
    point.writeFloatLE(point.readFloatLE(8) + wrong * Math.sin(i), 8)
    kept.push(point)
  }
  return Buffer.concat([Buffer.from(text.slice(0, begin).replace(/element vertex \d+/, `element vertex ${kept.length}`), 'latin1'), ...kept])
}

test('the page sends, shows, ranks, and takes text for text', async () => {
  const made = method => readFileSync(join(sessions, 'tank', 'clouds', `${method}.ply`))
  for (const [name, cloud, uses] of [['Stripe, every second point', worse(good, 2, 0), 'laser'], ['Stripe, first try', worse(good, 1, 0.004), 'laser'], ['Stripe as in the paper', made('laser_paper'), 'laser'],
    ['Semi-global matching', made('stereo'), 'stereo'], ['Block matching as in the paper', made('stereo_paper'), 'stereo']])
    assert.equal((await platform.scored('clouds', cloud, { name, uses })).state, 'done')
  const browser = await launchBrowser(web, executablePath)
  try {
    const page = await (await browser.newContext({ viewport: { width: 1280, height: 900 } })).newPage()
    const bad = []
    page.on('pageerror', error => bad.push(String(error)))
    page.on('dialog', dialog => { bad.push(dialog.message()); void dialog.dismiss() })
    page.on('console', message => { if (message.type() === 'error' && !/429|503/.test(message.text())) bad.push(message.text()) })
    await page.goto(platform.address)
    const send = async name => {
      await page.getByLabel('Name').fill(name)
      await page.getByLabel('File').setInputFiles({ name: 'mine.ply', mimeType: 'application/octet-stream', buffer: good })
      await page.getByRole('button', { name: 'Send' }).click()
      await page.waitForURL(/\/submissions\//)
      await page.locator('#state').waitFor()
      await keep(page, 'platform_waiting')
      await page.locator('#figures').waitFor({ timeout: patience })
      assert.equal(await page.locator('h2').first().textContent(), name)
      await page.frameLocator('iframe').locator('#cloud-view canvas').waitFor()
      return page.url()
    }
    const front = async () => {
      await page.goto(`${platform.address.split('/?')[0]}/`)
      await page.locator('#leaderboard').waitFor()
    }
    await send('Stripe, sub-pixel')
    if (pictures) await page.waitForTimeout(1500) // its 3D view is drawn
    await keep(page, 'platform_submission')
    await front()
    await page.getByRole('button', { name: 'Mean error' }).click()
    await page.locator('th[aria-sort] button', { hasText: 'Mean error' }).waitFor()
    const ranks = await page.locator('#leaderboard tbody tr a').allTextContents()
    assert.ok(ranks.indexOf('Stripe, every second point') < ranks.indexOf('Stripe, first try'), ranks.join())
    await keep(page, 'platform')
    if (pictures) return
    const hostile = '<img src=x onerror=alert(1)>'
    const link = await send(hostile)
    await front()
    assert.ok(await page.getByRole('link', { name: hostile, exact: true }).first().isVisible())
    await page.setViewportSize({ width: 800, height: 900 })
    const wide = await page.evaluate(() => document.documentElement.scrollWidth)
    assert.ok(wide <= 800, `the page is ${wide} pixels wide`)
    await page.goto(link)
    await page.locator('#figures').waitFor()
    assert.deepEqual(bad, [])
  } finally {
    await browser.close()
  }
})

test('it has no rig and no command of one', async () => {
  const { stderr, status } = spawnSync(program, ['serve', '--platform', '--rig', rig], { cwd: folder, encoding: 'utf8' })
  assert.equal(status, 2)
  assert.match(stderr, /--platform excludes --rig|--rig excludes --platform/)
  for (const path of ['/api/arm', '/api/doctor', '/sessions/tank/session.yaml', '/console.js']) assert.equal((await platform.get(path)).status, 404, path)
})
