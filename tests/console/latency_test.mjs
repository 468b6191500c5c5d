// Ten watchers of every live stream beside none: how late the cycle wakes on emulated wires. Arguments as browser_test.mjs; no browser is needed.
import assert from 'node:assert/strict'
import { spawn } from 'node:child_process'
import { mkdtempSync, readdirSync, readFileSync, rmSync } from 'node:fs'
import http from 'node:http'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import { test } from 'node:test'

import { smallRig, until } from './small_rig.mjs'
import { watch } from './watcher.mjs'

const [rig, program] = process.argv.slice(2)
const most = 1.1 // of the latency without watchers
const patience = 240_000 // [ms] for a scan
const mostOfACamera = 0.1 // of a processor, for its pictures on the page

/** The cycle's wake-up latency of a session [us]. */
function latencyOf(session) {
  const text = readFileSync(join(session, 'session.yaml'), 'utf8')
  const [, p50, p99] = /wake_up_us:\s*\{p50: ([\d.e+]+), p99: ([\d.e+]+)/.exec(text) ?? []
  assert.ok(p99, text)
  return { p50: Number(p50), p99: Number(p99) }
}

/** Of the thread that makes the page's pictures, in a child of `server`: its processor time [s]; nothing if there is none. */
function picturesTime(server) {
  try {
    const children = readFileSync(`/proc/${server}/task/${server}/children`, 'utf8').split(' ').filter(pid => pid)
    for (const pid of children)
      for (const thread of readdirSync(`/proc/${pid}/task`)) {
        const [, name, rest] = /\((.*)\) (.*)/.exec(readFileSync(`/proc/${pid}/task/${thread}/stat`, 'utf8'))
        if (name === 'pictures') return rest.split(' ').slice(11, 13).reduce((sum, ticks) => sum + Number(ticks) / 100, 0)
      }
  } catch {
    // it has just ended
  }
  return undefined
}

test('ten watchers do not delay the cycle', async t => {
  const folder = mkdtempSync(join(tmpdir(), 'tankrig-test-'))
  smallRig(program, rig, join(folder, 'rig'))
  const server = spawn(program, ['serve', '--rig', 'rig', '--port', '0'], { cwd: folder, stdio: ['ignore', 'pipe', 'inherit'] })
  const over = new Promise(done => server.on('exit', done))
  try {
    let said = ''
    server.stdout.on('data', data => { said += data })
    await until('the address', () => /http:\S+/.test(said), 20_000)
    const address = /http:\S+/.exec(said)[0]
    const cookie = await new Promise(done => http.get(address, response => done(response.headers['set-cookie'][0].split(';')[0])))
    const operator = await watch(address, cookie)
    operator.say({ do: 'take' })

    const scan = async watchers => {
      const others = await Promise.all(Array.from({ length: watchers }, () => watch(address, cookie)))
      const before = operator.texts.length
      operator.say({ do: 'start', command: 'scan', options: {} })
      const ended = () => operator.texts.slice(before).some(text => text.is === 'run' && Number.isInteger(text.exit_code))
      let first, last, looked = 0 // of the pictures' thread: when it was looked at, and its time
      await until('the end', () => {
        if (Date.now() < looked + 500) return ended()
        looked = Date.now()
        const used = picturesTime(server.pid)
        if (used !== undefined) last = { at: looked, used }
        first ??= last
        return ended()
      }, patience)
      const cameras = operator.texts.findLast(text => text.feed === 'cameras')?.cameras.length ?? NaN
      const share = last ? (last.used - first.used) / ((last.at - first.at) / 1000) / cameras : NaN
      const pictures = Math.min(...others.map(other => other.pictures))
      for (const other of others) {
        assert.equal(other.closed, false)
        other.end()
      }
      const exitCode = operator.last('run').exit_code
      const session = join(folder, 'sessions', readdirSync(join(folder, 'sessions')).filter(name => name.includes('-2')).sort().at(-1))
      return { exitCode, pictures, share, session, log: operator.texts.filter(text => text.is === 'log').map(text => text.text).join('').trim().split('\n').at(-1) }
    }
    const runs = []
    for (const watchers of [0, 10, 0, 10, 0]) {
      const run = await scan(watchers)
      if (run.exitCode !== 0) return t.skip(`skipped: this machine is too slow for a scan over wires: ${run.log}`)
      if (watchers > 0) assert.ok(run.pictures > 0)
      console.log(`pictures of a camera: ${(100 * run.share).toFixed(1)} % of a processor (${watchers} watchers)`)
      assert.ok(run.share < mostOfACamera, `${run.share} of a processor`)
      runs.push(latencyOf(run.session))
    }
    operator.end()
    // A machine differs from itself from run to run: how much, three scans tell; what watchers cost is the mean of two.
    const [none, ten] = [runs.filter((_, i) => i % 2 === 0), runs.filter((_, i) => i % 2 === 1)]
    const words = `wake-up p50/p99 [us]: ${runs.map(run => `${run.p50}/${run.p99}`).join(', ')} (none, ten, none, ten, none)`
    console.log(words)
    for (const share of ['p50', 'p99']) {
      const [least, greatest] = [Math.min(...none.map(run => run[share])), Math.max(...none.map(run => run[share]))]
      if (greatest > most * least) return t.skip(`skipped: without watchers it differs by more than 10 % from itself: ${words}`)
      assert.ok((ten[0][share] + ten[1][share]) / 2 <= most * greatest, words)
    }
  } finally {
    if (server.exitCode === null) server.kill('SIGINT')
    await over
    rmSync(folder, { recursive: true, force: true })
  }
})
