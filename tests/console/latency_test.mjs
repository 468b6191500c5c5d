// Ten watchers of every live stream come and go during one scan over emulated wires: how late the cycle wakes with them and without.
// Arguments as browser_test.mjs; no browser is needed.
import assert from 'node:assert/strict'
import { spawn } from 'node:child_process'
import { mkdtempSync, readdirSync, readFileSync, rmSync } from 'node:fs'
import http from 'node:http'
import { tmpdir } from 'node:os'
import { join } from 'node:path'
import { test } from 'node:test'

import { edit, smallRig, until } from './small_rig.mjs'
import { watch } from './watcher.mjs'

const [rig, program] = process.argv.slice(2)
const most = 1.1 // of the latency without watchers
const turn = 2_000 // [ms] with them, and without
const patience = 400_000 // [ms] for the scan
const mostOfACamera = 0.1 // of a processor, for its pictures on the page

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

const sum = (turns, kind) => turns.map(one => one[kind]).reduce((all, counts) => all.map((n, i) => n + counts[i]))

/** The `share` quantile [us] of counts in bins, straight within its bin. */
function quantile(counts, upper_us, share) {
  let below = share * counts.reduce((all, n) => all + n, 0)
  for (let i = 0; i < upper_us.length; ++i) {
    const lower = i > 0 ? upper_us[i - 1] : 0
    if (below <= counts[i]) return lower + ((upper_us[i] - lower) * below) / counts[i]
    below -= counts[i]
  }
  return Infinity
}

/** Watchers' latency over that without; and what 95 % of such figures exceed if the turns are drawn anew (bootstrap, seed 1). */
function compared(turns, upper_us, share) {
  const ratio = drawn => quantile(sum(drawn, 'ten'), upper_us, share) / quantile(sum(drawn, 'none'), upper_us, share)
  let seed = 1
  const any = () => turns[(seed = (seed * 48271) % 2147483647) % turns.length]
  const ratios = Array.from({ length: 1000 }, () => ratio(turns.map(any))).sort((a, b) => a - b)
  return { ratio: ratio(turns), atLeast: ratios[50], atMost: ratios[949] }
}

/** Told to ctest too. */
function skip(t, why) {
  process.exitCode = 77
  t.skip(`skipped: ${why}`)
}

test('ten watchers do not delay the cycle', async t => {
  const folder = mkdtempSync(join(tmpdir(), 'tankrig-test-'))
  smallRig(program, rig, join(folder, 'rig'))
  edit(join(folder, 'rig', 'rig.yaml'), ['\nscan:\n', '\nscan:\n  sweep: {passes: 4}\n'])
  const server = spawn(program, ['serve', '--rig', 'rig', '--port', '0'], { cwd: folder, stdio: ['ignore', 'pipe', 'inherit'] })
  const over = new Promise(done => server.on('exit', done))
  try {
    let said = ''
    server.stdout.on('data', data => { said += data })
    await until('the address', () => /http:\S+/.test(said), 20_000)
    const address = /http:\S+/.exec(said)[0]
    const cookie = await new Promise(done => http.get(address, response => done(response.headers['set-cookie'][0].split(';')[0])))
    const operator = await watch(address, cookie)
    const ended = () => operator.texts.some(text => text.is === 'run' && Number.isInteger(text.exit_code))
    const seen = () => operator.texts.findLast(text => text.feed === 'state' && text.wake_ups)?.wake_ups
    operator.say({ do: 'take' })
    operator.say({ do: 'start', command: 'scan', options: {} })
    await until('the first cycles', () => ended() || seen(), patience)

    const turns = []
    let first, last // of the pictures' thread: when it was looked at, and its time
    let cameras = NaN, others = [], pictures = 0 // that every watcher got
    /** What the cycle's wake-ups add up to in a turn that begins so; nothing if the scan ended meanwhile. */
    const counted = async begin => {
      const before = seen(), until_ms = Date.now() + turn
      await begin()
      await until('the turn', () => ended() || Date.now() >= until_ms, patience)
      return ended() ? undefined : seen().counts.map((n, i) => n - before.counts[i])
    }
    while (!ended()) {
      const none = await counted(() => {})
      const ten = none && await counted(async () => { others = await Promise.all(Array.from({ length: 10 }, () => watch(address, cookie))) })
      if (!ten) break
      turns.push({ none, ten })
      for (const other of others) {
        assert.equal(other.closed, false)
        other.end()
      }
      pictures += Math.min(...others.map(other => other.pictures))
      const used = picturesTime(server.pid)
      if (used !== undefined) last = { at: Date.now(), used }
      first ??= last
      cameras = operator.texts.findLast(text => text.feed === 'cameras')?.cameras.length ?? NaN
    }
    for (const other of others) other.end()
    await until('the end', ended, patience)
    const { upper_us } = seen()
    const log = operator.texts.filter(text => text.is === 'log').map(text => text.text).join('').trim().split('\n').at(-1)
    const exitCode = operator.last('run').exit_code
    operator.end()
    if (exitCode !== 0) return skip(t, `this machine is too slow for a scan over wires: ${log}`)

    assert.ok(pictures > turns.length, `${pictures} pictures`)
    const ofACamera = (last.used - first.used) / ((last.at - first.at) / 1000) / cameras
    console.log(`pictures of a camera: ${(100 * ofACamera).toFixed(1)} % of a processor`)
    assert.ok(ofACamera < mostOfACamera, `${ofACamera} of a processor`)
    const cycles = sum(turns, 'none').reduce((all, n) => all + n)
    for (const [name, share] of [['median', 0.5], ['99 %', 0.99]]) {
      const { ratio, atLeast, atMost } = compared(turns, upper_us, share)
      const us = kind => quantile(sum(turns, kind), upper_us, share).toFixed(1)
      const words = `wake-up, ${name} [us]: ${us('none')} without watchers, ${us('ten')} with ten; ${ratio.toFixed(2)} times (${atLeast.toFixed(2)} to ${atMost.toFixed(2)}), ${turns.length} turns, ${cycles} cycles each`
      console.log(words)
      if (ratio > most && atLeast <= most) return skip(t, `this machine differs too much from itself: ${words}`)
      assert.ok(ratio <= most, words)
    }
  } finally {
    if (server.exitCode === null) server.kill('SIGINT')
    await over
    rmSync(folder, { recursive: true, force: true })
  }
})
