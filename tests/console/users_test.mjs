// The console for users beyond this machine: who is let in, what each role may do, TLS, and a page of another version. Arguments as browser_test.mjs.
import assert from 'node:assert/strict'
import { execFileSync, spawn, spawnSync } from 'node:child_process'
import { copyFileSync, mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs'
import http from 'node:http'
import https from 'node:https'
import net from 'node:net'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import { after, afterEach, before, test } from 'node:test'
import tls from 'node:tls'

import { launchBrowser } from './browser.mjs'
import { keep } from './pictures.mjs'
import { smallRig, until as within } from './small_rig.mjs'
import { watch } from './watcher.mjs'

const [rig, program, web, executablePath] = process.argv.slice(2)
const password = { anna: 'annas password', ben: 'bens password', carl: 'carls password' }
const role = { anna: 'watch', ben: 'operate', carl: 'administer' }

let browser, folder, server, address

const until = (what, condition, milliseconds = 60_000) => within(what, condition, milliseconds)
const users = () => join(folder, 'users')
const addUser = (name, as, line, file = users()) =>
  spawnSync(program, ['serve', 'user', 'add', name, '--role', as, '--users', file], { input: `${line}\n`, encoding: 'utf8' })

/** A server that runs, at `address`. */
const serve = (...options) => start('--rig', rig, ...options)
async function start(...options) {
  server = spawn(program, ['serve', ...options], { cwd: folder, stdio: ['ignore', 'pipe', 'pipe'] })
  server.said = ''
  for (const stream of [server.stdout, server.stderr]) stream.on('data', data => { server.said += data })
  server.over = new Promise(done => server.on('exit', code => done(code)))
  await until('the address', () => /https?:\S+/.test(server.said) || server.exitCode !== null)
  address = /https?:\S+/.exec(server.said)?.[0]
  assert.ok(address, server.said)
}
const withUsers = ['--users', 'users', '--port', '0']
const withTls = ['--users', 'users', '--tls-cert', 'cert.pem', '--tls-key', 'key.pem', '--listen', '127.0.0.1:0']

/** What serve says that does not start. */
const refusal = (...options) => spawnSync(program, ['serve', '--rig', rig, ...options], { cwd: folder, encoding: 'utf8', timeout: 120_000 })

/** An answer with its body as text. */
const ask = (path, { headers = {}, method = 'GET', body, from } = {}) =>
  new Promise((done, failed) => {
    const { protocol, hostname, port } = new URL(address)
    const request = (protocol === 'https:' ? https : http).request({ hostname, port, path, method, headers, rejectUnauthorized: false, localAddress: from, agent: false }, response => {
      let text = ''
      response.on('data', data => { text += data })
      response.on('end', () => done(Object.assign(response, { text })))
    })
    request.on('error', failed)
    request.on('upgrade', (response, socket) => { socket.destroy(); done(response) })
    request.end(body)
  })
const origin = () => new URL(address).origin
const logIn = (name, word, headers = { Origin: origin() }, from) =>
  ask('/login', { method: 'POST', headers: { 'Content-Type': 'application/x-www-form-urlencoded', ...headers }, body: new URLSearchParams({ name, password: word }).toString(), from })
const cookieOf = answer => answer.headers['set-cookie'][0].split(';')[0]
const letIn = async name => cookieOf(await logIn(name, password[name]))

async function open(name, width = 1280, height = 900) {
  const context = await browser.newContext({ viewport: { width, height }, ignoreHTTPSErrors: true })
  const page = await context.newPage()
  await page.goto(address)
  if (name) {
    await page.getByLabel('Name').fill(name)
    await page.getByLabel('Password').fill(password[name])
    await page.getByRole('button', { name: 'Log in' }).click()
    await page.getByText('connected', { exact: true }).waitFor()
  }
  return page
}

before(async () => {
  browser = await launchBrowser(web, executablePath, ['--disable-features=LocalNetworkAccessChecks']) // a page that the test alters comes from nowhere
  folder = mkdtempSync(join(tmpdir(), 'tankrig-test-'))
  for (const name of Object.keys(role)) assert.equal(addUser(name, role[name], password[name]).status, 0)
  execFileSync('openssl', ['req', '-x509', '-newkey', 'ec', '-pkeyopt', 'ec_paramgen_curve:prime256v1', '-nodes', '-keyout', join(folder, 'key.pem'), '-out', join(folder, 'cert.pem'),
    '-days', '2', '-subj', '/CN=127.0.0.1'], { stdio: 'ignore' })
})
afterEach(async () => {
  for (const context of browser.contexts()) await context.close()
  if (server && server.exitCode === null && server.signalCode === null) server.kill('SIGINT')
  await server?.over
  server = undefined
})
after(async () => {
  await browser.close()
  rmSync(folder, { recursive: true, force: true })
})

test('users are added and removed, each bad wish is named in one line', () => {
  const file = join(folder, 'others')
  assert.match(addUser('dora', 'watch', 'doras password', file).stdout, /dora may watch/)
  for (const [run, said] of [
    [addUser('dora', 'watch', 'doras password', file), /found dora, expected a new name/],
    [addUser('Dora', 'watch', 'doras password', file), /found the name 'Dora'/],
    [addUser('emil', 'watch', 'short', file), /found 5 bytes, expected 10 to 200/],
  ]) {
    assert.equal(run.status, 1)
    assert.match(run.stderr, said)
    assert.equal(run.stderr.trim().split('\n').length, 1)
  }
  assert.equal(addUser('emil', 'root', 'emils password', file).status, 2)
  const remove = () => spawnSync(program, ['serve', 'user', 'remove', 'dora', '--users', file], { encoding: 'utf8' })
  assert.equal(remove().status, 0)
  assert.match(remove().stderr, /found no dora/)
})

test('others reach it only with users, and with TLS or its waiver', () => {
  for (const [options, said] of [
    [['--listen', '0.0.0.0:0'], /expected --users FILE/],
    [['--listen', '0.0.0.0:0', '--without-tls'], /expected --users FILE/],
    [['--listen', '[::]:0', '--users', 'users'], /expected --tls-cert and --tls-key with it, or --without-tls/],
    [['--listen', 'everywhere:1'], /expected ADDRESS:PORT/],
    [['--listen', '127.0.0.1:70000'], /expected ADDRESS:PORT/],
    [['--listen', '127.0.0.1'], /expected ADDRESS:PORT/],
    [['--listen', '127.0.0.1:0', '--port', '1'], /excludes/],
    [['--tls-cert', 'cert.pem'], /requires/],
  ]) {
    const run = refusal(...options)
    assert.equal(run.status, 2, `${options}: ${run.stderr}`)
    assert.match(run.stderr, said)
    if (said.source.startsWith('expected')) assert.equal(run.stderr.trim().split('\n').length, 1)
  }
})

test('it does not start with a certificate, key or users\' file that cannot be used', () => {
  writeFileSync(join(folder, 'bad'), 'anna watch\n', { mode: 0o600 })
  writeFileSync(join(folder, 'nobody'), '', { mode: 0o600 })
  for (const [options, said] of [
    [['--port', '0', '--users', 'bad'], /bad:1: found 2 words/],
    [['--port', '0', '--users', 'none'], /none/],
    [['--port', '0', '--users', 'nobody'], /found no user/],
    [['--port', '0', '--users', 'users', '--tls-cert', 'users', '--tls-key', 'key.pem'], /users: .*expected a certificate in PEM/],
    [['--port', '0', '--users', 'users', '--tls-cert', 'cert.pem', '--tls-key', 'users'], /users: .*key in PEM/],
  ]) {
    const run = refusal(...options)
    assert.equal(run.status, 1, run.stderr)
    assert.match(run.stderr, said)
    assert.equal(run.stderr.trim().split('\n').length, 1)
  }
})

test('a password lets in, from the login page alone', async () => {
  await serve(...withUsers)
  assert.doesNotMatch(server.said, /key=/)
  assert.equal((await ask('/')).headers.location, '/login')
  assert.match((await ask('/login')).headers['content-security-policy'], /default-src 'none'.*form-action 'self'/)
  for (const path of ['/console.js', '/api/sessions', '/sessions/a/b', '/live', '/?key=']) assert.ok([401, 303].includes((await ask(path)).statusCode), path)
  const good = await logIn('ben', password.ben)
  assert.equal(good.statusCode, 303)
  assert.match(good.headers['set-cookie'][0], /^tankrig_\d+=[0-9a-f]{32}; Path=\/; HttpOnly; SameSite=Strict$/)
  const Cookie = cookieOf(good)
  const page = await ask('/', { headers: { Cookie } })
  assert.equal(page.statusCode, 200)
  assert.match(page.headers['content-security-policy'], /default-src 'none'; script-src 'self'.*frame-ancestors 'none'/)
  for (const headers of [{}, { Origin: 'http://evil.example' }, { Origin: 'null' }, { Origin: origin(), Host: 'evil.example' }]) {
    assert.equal((await logIn('ben', password.ben, headers)).statusCode, 403)
    assert.equal((await ask('/logout', { method: 'POST', headers: { Cookie, ...headers } })).statusCode, 403)
  }
  assert.equal((await ask('/', { headers: { Cookie } })).statusCode, 200)
  const watcher = await watch(address, Cookie)
  assert.equal((await ask('/logout', { method: 'POST', headers: { Cookie, Origin: origin() } })).statusCode, 303)
  await until('the WebSocket\'s end', () => watcher.closed, 2000)
  assert.equal((await ask('/', { headers: { Cookie } })).statusCode, 303)
  await assert.rejects(watch(address, Cookie), /401/)
})

test('a wrong password is refused, the next one later and later; another address may try', async () => {
  await serve(...withUsers)
  const wrong = await logIn('ben', 'not bens password')
  assert.equal(wrong.statusCode, 401)
  assert.match(wrong.text, /Wrong name or password/)
  assert.equal(wrong.headers['set-cookie'], undefined)
  for (const n of [2, 3]) await until(`try ${n}`, async () => (await logIn('nobody', password.ben)).statusCode === 401)
  const early = await logIn('ben', password.ben)
  assert.equal(early.statusCode, 429)
  assert.match(early.text, /wait for [1-4] s/)
  assert.equal((await logIn('ben', password.ben, { Origin: origin() }, '127.0.0.2')).statusCode, 303)
  await until('a right one', async () => (await logIn('ben', password.ben)).statusCode === 303)
  assert.match(server.said, /refused a login as 'nobody'/)
})

test('few passwords are tried at a time', async () => {
  await serve(...withUsers)
  const tries = await Promise.all([2, 3, 4, 5, 6, 7].map(n => logIn('ben', password.ben, { Origin: origin() }, `127.0.0.${n}`)))
  const codes = tries.map(answer => answer.statusCode).sort()
  assert.ok(codes.includes(303) && codes.includes(503), String(codes))
})

test('a user who is added may log in at once; one who is removed may not again', async () => {
  await serve(...withUsers)
  assert.equal(addUser('eva', 'watch', 'evas password').status, 0)
  const Cookie = cookieOf(await logIn('eva', 'evas password'))
  assert.equal(spawnSync(program, ['serve', 'user', 'remove', 'eva', '--users', users()]).status, 0)
  assert.equal((await logIn('eva', 'evas password')).statusCode, 401)
  assert.equal((await ask('/', { headers: { Cookie } })).statusCode, 200)
})

const user = (...words) => spawnSync(program, ['serve', 'user', ...words, '--users', users()], { encoding: 'utf8' })
const giveToken = (...words) => user('token', ...words).stdout.trim()

test('tokens are given, listed and revoked, each bad wish is named in one line', () => {
  const given = user('token', 'ben', 'laptop', '--role', 'watch')
  assert.match(given.stdout, /^tankrig-[0-9a-f]{40}\n$/)
  assert.match(given.stderr, /may watch for ben/)
  assert.ok(!readFileSync(users(), 'utf8').includes(given.stdout.trim()))
  assert.match(user('list').stdout, /ben +may operate\n +token laptop +may watch\n/)
  for (const [run, said] of [
    [user('token', 'ben', 'laptop'), /found ben's token laptop, expected a new label/],
    [user('token', 'nobody', 'laptop'), /found no nobody/],
    [user('token', 'ben', 'my laptop'), /found the name 'my laptop'/],
    [user('token', 'ben', 'other', '--role', 'administer'), /ben may operate, expected a token for no more/],
    [user('revoke', 'ben', 'other'), /found no token other of ben/],
  ]) {
    assert.equal(run.status, 1)
    assert.match(run.stderr, said)
    assert.equal(run.stderr.trim().split('\n').length, 1)
  }
  assert.equal(user('token', 'ben', 'other', '--role', 'root').status, 2)
  assert.equal(user('revoke', 'ben', 'laptop').status, 0)
  assert.doesNotMatch(user('list').stdout, /token/)
})

test('a token lets a program of its user in, by its role, until it is revoked', async () => {
  const [watches, operates] = [giveToken('ben', 'lamp', '--role', 'watch'), giveToken('ben', 'script')]
  await serve(...withUsers)
  const by = (token, headers = {}) => ({ headers: { Authorization: `Bearer ${token}`, ...headers } })
  assert.equal((await ask('/api/sessions', by(watches))).statusCode, 200)
  assert.match((await ask('/api/arm', by(watches))).text, /needs the role operate/)
  assert.equal((await ask('/api/plan', by(operates))).statusCode, 200)
  assert.match((await ask('/api/corners', by(operates))).text, /needs the role administer/)
  for (const wrong of ['', `${operates}0`, operates.toUpperCase(), password.ben]) {
    const refused = await ask('/api/sessions', by(wrong))
    assert.equal(refused.statusCode, 401)
    assert.match(refused.text, /nobody has this token/)
  }
  assert.equal((await ask('/api/sessions', { headers: { Cookie: `tankrig_${new URL(address).port}=${operates}` } })).statusCode, 401)
  assert.equal((await ask('/api/sessions', by(operates, { Origin: 'http://evil.example' }))).statusCode, 403)
  assert.equal((await ask('/api/sessions', by(operates, { Host: 'evil.example' }))).statusCode, 403)
  const upgrade = { Origin: origin(), Connection: 'Upgrade', Upgrade: 'websocket', 'Sec-WebSocket-Version': '13', 'Sec-WebSocket-Key': Buffer.alloc(16).toString('base64') }
  assert.equal((await ask('/live', by(operates, upgrade))).statusCode, 401)
  const flooded = await flood(`Authorization: Bearer ${watches}\r\n`)
  assert.ok(flooded(404) >= 480 && flooded(429) > 0, `${flooded(404)} served, ${flooded(429)} refused`) // 500 at once, less those asked before
  await until('calm', async () => (await ask('/api/sessions', by(watches))).statusCode === 200)
  assert.equal(user('revoke', 'ben', 'lamp').status, 0)
  assert.equal((await ask('/api/sessions', by(watches))).statusCode, 401)
  assert.equal((await ask('/login', by(operates))).statusCode, 200)
  assert.equal(user('revoke', 'ben', 'script').status, 0)
})

test('programs send to a platform with users: the examples of its documentation', async t => {
  const text = readFileSync(new URL('../../docs/reference/platform.md', import.meta.url), 'utf8')
  const example = kind => new RegExp('```' + kind + '\\n([^`]*cloud\\.ply[^`]*)```').exec(text)[1]
  smallRig(program, rig, join(folder, 'small'))
  execFileSync(program, ['scan', '--preset', 'short', '--rig', join(folder, 'small'), '--out', join(folder, 'datasets', 'tank')], { cwd: folder, stdio: 'ignore' })
  copyFileSync(join(folder, 'datasets', 'tank', 'clouds', 'laser.ply'), join(folder, 'cloud.ply'))
  const [token, lesser] = [giveToken('ben', 'script'), giveToken('ben', 'lamp', '--role', 'watch')]
  await start('--platform', '--datasets', 'datasets', ...withUsers)
  const run = (command, args) => spawnSync(command, args, { cwd: folder, encoding: 'utf8', timeout: 240_000 })
  const filledIn = (code, key, id = '') => code.replaceAll('http://127.0.0.1:8080', origin()).replaceAll(/\bKEY"/g, `${key}"`).replaceAll('/ID', `/${id}`)

  const python = run('python3', ['-c', filledIn(example('python'), token)])
  assert.equal(python.status, 0, python.stderr)
  const [link] = python.stdout.split(' ')
  assert.match(python.stdout, /^\/submissions\/[0-9a-z]{16} None \{'tolerance_m': 0\.002/)
  const score = JSON.parse((await ask(`/api${link}`, { headers: { Authorization: `Bearer ${token}` } })).text)
  assert.equal(score.state, 'done')
  assert.equal(score.user, 'ben')

  const refused = await ask('/api/clouds?dataset=tank&name=mine', { method: 'POST', headers: { Authorization: `Bearer ${lesser}` }, body: 'ply\n' })
  assert.match(refused.text, /needs the role operate/)
  assert.equal((await ask('/api/clouds?dataset=tank&name=mine', { method: 'POST', headers: { Cookie: await letIn('ben') }, body: 'ply\n' })).statusCode, 403) // a cookie without a page
  const [send, look] = filledIn(example('sh'), token, link.split('/').pop()).trim().split(/\n(?=curl)/)
  if (run('curl', ['--version']).status !== 0) return t.diagnostic('no curl: its example is not run')
  const sent = run('sh', ['-c', send])
  assert.equal(JSON.parse(sent.stdout).state, 'queued', sent.stdout + sent.stderr)
  assert.equal(JSON.parse(run('sh', ['-c', look]).stdout).state, 'done')
})

/** Asks 3000 times at once; returns how many answers have a code. */
async function flood(headers = '') {
  const { hostname, port, host } = new URL(address)
  const asked = 3000
  const text = await new Promise(done => {
    let heard = ''
    const socket = net.connect(Number(port), hostname, () => socket.write(`GET /sessions/nothing HTTP/1.1\r\nHost: ${host}\r\n${headers}\r\n`.repeat(asked)))
    socket.on('data', data => {
      heard += data.toString('latin1')
      if (heard.split('HTTP/1.1 ').length > asked) { socket.destroy(); done(heard) }
    })
    socket.on('close', () => done(heard))
  })
  return code => text.split(`HTTP/1.1 ${code}`).length - 1
}

test('one address that asks without end is refused, others are served', async () => {
  await serve(...withUsers)
  const answered = await flood()
  assert.ok(answered(401) >= 500, `${answered(401)} served`)
  assert.ok(answered(429) > 0, `${answered(401)} served`)
  assert.equal((await ask('/login', { from: '127.0.0.2' })).statusCode, 200)
})

test('one address cannot hold all connections', async () => {
  await serve(...withUsers)
  const { hostname, port } = new URL(address)
  const held = await Promise.all(Array.from({ length: 300 }, () => new Promise(done => { const socket = net.connect(Number(port), hostname, () => done(socket)); socket.on('error', () => done(socket)) })))
  assert.equal((await ask('/login', { from: '127.0.0.2' })).statusCode, 200)
  for (const socket of held) socket.destroy()
})

/** Says `wishes` and returns why each is refused; '' if it is not. */
async function refusals(watcher, wishes) {
  const why = []
  for (const wish of wishes) {
    const before = watcher.texts.length
    const said = () => watcher.texts.slice(before).filter(text => text.is === 'refused').map(text => text.why)
    watcher.say(wish)
    watcher.say(0) // answered after it
    await until('an answer', () => said().at(-1)?.includes('no JSON object'))
    why.push(said().length > 1 ? said()[0] : '')
  }
  return why
}

test('each role may do its part, whatever a request is made by hand', async () => {
  await serve(...withUsers)
  const starts = ['scan', 'preview', 'lit', 'jog', 'park', 'home', 'make_safe', 'calibrate', 'report', 'check', 'recover', 'experiment', 'bench'].map(command => ({ do: 'start', command, options: {} }))
  const anna = await watch(address, await letIn('anna'))
  const wishes = [{ do: 'take' }, { do: 'rig', name: 'tank-wire' }, ...starts, { do: 'offer' }, { do: 'release' }, { do: 'answer', text: 'y' }, { do: 'hold' }, { do: 'corners', folder: 'x', corners: [] }]
  for (const [i, why] of (await refusals(anna, wishes)).entries()) assert.match(why, /this needs the role (operate|administer)/, JSON.stringify(wishes[i]))
  assert.equal(anna.last('control').holder, null)
  assert.equal(anna.last('run'), undefined)
  assert.deepEqual(anna.last('hello').forms.filter(form => form.granted), [])
  assert.equal(anna.last('hello').forms.find(form => form.name === 'calibrate').role, 'administer')
  for (const question of ['arm', 'doctor', 'plan'])
    assert.equal((await ask(`/api/${question}`, { headers: { Cookie: await letIn('anna') } })).statusCode, 403)

  const ben = await watch(address, await letIn('ben'))
  assert.equal((await refusals(ben, [{ do: 'take' }]))[0], '')
  for (const command of ['calibrate', 'report', 'recover'])
    assert.match((await refusals(ben, [{ do: 'start', command, options: { session: 'x' } }]))[0], /this needs the role administer/)
  assert.match((await refusals(ben, [{ do: 'corners', folder: 'x', corners: [] }]))[0], /this needs the role administer/)
  assert.equal(ben.last('hello').role, 'operate')
  assert.ok(ben.last('hello').forms.find(form => form.name === 'scan').granted)
  assert.ok(!ben.last('hello').forms.find(form => form.name === 'calibrate').granted)
  ben.say({ do: 'start', command: 'scan', options: {} })
  await until('the run', () => ben.last('run')?.exit_code === null)

  anna.say({ do: 'stop' }) // who may look may stop
  await until('the end', () => Number.isInteger(anna.last('run')?.exit_code), 120_000)
  assert.ok([3, 130].includes(anna.last('run').exit_code)) // the latter: before it had begun
  assert.equal(anna.last('control').holder_name, 'ben')

  const carl = await watch(address, await letIn('carl'))
  ben.say({ do: 'offer' })
  await until('the offer', () => carl.last('control')?.offered)
  assert.equal((await refusals(carl, [{ do: 'take' }]))[0], '')
  assert.match((await refusals(carl, [{ do: 'corners', folder: '../x', corners: [] }]))[0], /folder: found/)
  for (const watcher of [anna, ben, carl]) watcher.end()
})

test('a watcher downloads a session whole; one that changes meanwhile breaks off', async () => {
  const session = join(folder, 'sessions/monday')
  mkdirSync(session, { recursive: true })
  writeFileSync(join(session, 'session.yaml'), 'status: complete\n')
  writeFileSync(join(session, 'can.log'), Buffer.alloc(64 << 20, 'x')) // more than a connection holds
  await serve(...withUsers)
  const Cookie = await letIn('anna')
  assert.equal((await ask('/downloads/monday.zip')).statusCode, 401)
  assert.equal((await ask('/downloads/..%2fusers.zip', { headers: { Cookie } })).statusCode, 404)
  /** Its bytes, and those that came; `meanwhile` while the connection is full. */
  const download = meanwhile => new Promise((done, failed) => {
    const { hostname, port } = new URL(address)
    http.get({ hostname, port, path: '/downloads/monday.zip', headers: { Cookie }, agent: false }, response => {
      let bytes = 0
      response.once('data', () => { // the first piece is there, the rest waits
        response.pause()
        meanwhile()
        response.on('data', data => { bytes += data.length })
        response.resume()
      })
      response.once('data', data => { bytes += data.length })
      for (const end of ['error', 'end']) response.on(end, () => done({ whole: response.complete, said: Number(response.headers['content-length']), bytes, code: response.statusCode }))
    }).on('error', failed)
  })
  let got
  await until('a session at rest', async () => (got = await download(() => {})).code === 200) // its times tell of a change after 20 ms
  assert.ok(got.whole)
  assert.equal(got.bytes, got.said)
  assert.ok(got.said > 64 << 20)
  const broken = await download(() => writeFileSync(join(session, 'can.log'), 'y', { flag: 'a' }))
  assert.equal(broken.whole, false)
  assert.ok(broken.bytes < broken.said)
  await until('it is said', () => /a download broke off: .*can.log: has changed while it was read/.test(server.said), 5000)
  rmSync(join(folder, 'sessions'), { recursive: true })
})

test('by TLS: its own version only, and nobody without it', async () => {
  await serve(...withTls)
  assert.match(address, /^https:/)
  assert.equal((await ask('/login')).statusCode, 200)
  assert.match((await logIn('ben', password.ben)).headers['set-cookie'][0], /; Secure$/)
  const { hostname, port } = new URL(address)
  const handshake = maxVersion => new Promise((done, failed) => {
    const socket = tls.connect({ host: hostname, port, rejectUnauthorized: false, minVersion: maxVersion, maxVersion, ciphers: 'DEFAULT@SECLEVEL=0' }, () => { done(socket.getProtocol()); socket.destroy() })
    socket.on('error', failed)
  })
  assert.equal(await handshake('TLSv1.3'), 'TLSv1.3')
  assert.equal(await handshake('TLSv1.2'), 'TLSv1.2')
  await assert.rejects(handshake('TLSv1.1'))
  const plain = await new Promise(done => {
    let text = ''
    const socket = net.connect(Number(port), hostname, () => socket.write(`GET / HTTP/1.1\r\nHost: ${hostname}:${port}\r\n\r\n`))
    socket.on('data', data => { text += data.toString('latin1') })
    for (const end of ['close', 'error']) socket.on(end, () => done(text))
  })
  assert.doesNotMatch(plain, /HTTP/)
  const page = await open('ben')
  assert.equal(await page.locator('#rig').textContent(), rig)
  const watcher = await watch(address, await letIn('anna'))
  await until('hello', () => watcher.last('hello'))
  watcher.end()
})

test('others reach it under the address they use and the names that are given', async () => {
  await serve('--listen', '0.0.0.0:0', '--users', 'users', '--without-tls', '--name', 'tank.lab')
  const { port } = new URL(address)
  assert.equal(new URL(address).hostname, 'tank.lab')
  address = `http://127.0.0.1:${port}`
  assert.equal((await ask('/login')).statusCode, 200)
  assert.equal((await ask('/login', { headers: { Host: `tank.lab:${port}` } })).statusCode, 200)
  assert.equal((await ask('/login', { headers: { Host: `evil.example:${port}` } })).statusCode, 403)
  assert.equal((await ask('/login', { headers: { Host: `127.0.0.2:${port}` } })).statusCode, 403)
})

test('in a browser: log in, look, log out', async () => {
  await serve(...withUsers)
  const page = await open()
  await page.setViewportSize({ width: 1280, height: 600 })
  await keep(page, 'console_login')
  await page.getByLabel('Name').fill('anna')
  await page.getByLabel('Password').fill('not annas password')
  await page.getByRole('button', { name: 'Log in' }).click()
  await page.getByText('Wrong name or password').waitFor()
  await new Promise(done => setTimeout(done, 1000)) // the delay itself
  await page.getByLabel('Name').fill('anna')
  await page.getByLabel('Password').fill(password.anna)
  await page.getByRole('button', { name: 'Log in' }).click()
  await page.getByText('connected', { exact: true }).waitFor()
  assert.equal(await page.getByRole('button', { name: 'Take control' }).isDisabled(), true)
  assert.equal(await page.getByRole('button', { name: 'STOP' }).isDisabled(), false)
  for (const [command, title, needs] of [['scan', 'Scan', 'operate'], ['calibrate', 'Calibrate', 'administer']]) {
    await page.locator('#command').selectOption(command)
    assert.equal(await page.getByRole('button', { name: `Start: ${title}` }).isDisabled(), true)
    assert.equal(await page.locator('#form [name=operator]').isDisabled(), true)
    assert.equal(await page.locator('#why-not').textContent(), `This needs the role ${needs}; yours is watch.`)
  }
  await keep(page, 'console_watch')
  await page.getByRole('button', { name: 'Log out' }).click()
  await page.getByLabel('Password').waitFor()
})

test('a page of yesterday says so, and is loaded anew', async () => {
  await serve('--port', '0')
  const page = await open()
  await page.getByText('connected', { exact: true }).waitFor()
  assert.equal(await page.locator('#outdated').isHidden(), true)
  const yesterday = async route => {
    const response = await route.fetch()
    await route.fulfill({ response, body: (await response.text()).replace(/(name="version" content=")[^"]*/, '$1yesterday') })
  }
  await page.route(url => url.pathname === '/', yesterday, { times: 1 })
  let loads = 0
  page.on('load', () => ++loads)
  await page.reload()
  await until('the page of today', () => loads === 2)
  await page.getByText('connected', { exact: true }).waitFor()
  assert.equal(await page.locator('#outdated').isHidden(), true)

  await page.route(url => url.pathname === '/', yesterday) // one that cannot be got rid of: it says so, without loading for ever
  await page.reload()
  await page.locator('#outdated', { hasText: 'This page is of another version (yesterday) than the server' }).waitFor()
  await until('the second load', () => loads === 4)
  await page.locator('#outdated', { hasText: 'only STOP works here' }).waitFor()
  assert.equal(await page.getByRole('button', { name: 'Take control' }).isDisabled(), true)
  await keep(page, 'console_outdated')
  await page.getByRole('button', { name: 'STOP' }).click()
  await page.locator('#run-state', { hasText: 'Laser off, arm at rest' }).waitFor()
  assert.equal(loads, 4)
})

test('a server that was started anew says what to do to a page of the last one', async () => {
  await serve('--port', '0')
  const { port } = new URL(address)
  const page = await open()
  await page.getByText('connected', { exact: true }).waitFor()
  server.kill('SIGINT')
  await server.over
  await serve('--port', port)
  await page.locator('#outdated', { hasText: 'open the address that it has printed' }).waitFor()
  const other = await page.context().newPage()
  await other.goto(address)
  await page.locator('#connection', { hasText: /^connected$/ }).waitFor()
  assert.equal(await page.locator('#outdated').isHidden(), true)
})
