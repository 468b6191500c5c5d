// A rig for tests of the console, and waiting for what it does.
import assert from 'node:assert/strict'
import { execFileSync } from 'node:child_process'
import { readFileSync, writeFileSync } from 'node:fs'
import { join } from 'node:path'

/** Waits until `condition` holds, and says how long that took. */
export const until = async (what, condition, milliseconds) => {
  const begin = Date.now()
  while (!(await condition())) {
    assert.ok(Date.now() - begin < milliseconds, `${what}: not within ${milliseconds} ms`)
    await new Promise(done => setTimeout(done, 20))
  }
  return Date.now() - begin
}

/** Once no test is left: what still keeps this process after `milliseconds` is named and fails it, where it would wait for ever. */
export function expectNothingOpen(milliseconds = 30_000) {
  setTimeout(() => {
    console.error(`still open after ${milliseconds} ms: ${process.getActiveResourcesInfo().join(', ')}`)
    console.error(execFileSync('ps', ['-o', 'pid,stat,etimes,args', '--ppid', String(process.pid)], { encoding: 'utf8' }))
    process.exit(1)
  }, milliseconds).unref()
}

/** Edits a file: each text is there, and is replaced. */
export function edit(file, ...pairs) {
  let text = readFileSync(file, 'utf8')
  for (const [from, to] of pairs) {
    assert.ok(text.includes(from), `${file} has no ${from}`)
    text = text.replaceAll(from, to)
  }
  writeFileSync(file, text)
}

/** As users have it. */
export function wholeRig(program, rig, place) {
  execFileSync(program, ['init', place, '--from', rig], { stdio: 'ignore' })
}

/** Where only the way matters: a simulated rig with small pictures and presets; one on wires that is patient with a busy machine. Of the
 *  presets, `short` is for a scan that is waited for: half the sweep; `long` for one that is stopped: it sweeps soon, and for long.
 *  `eyes`: how many times smaller the stereo pictures are; those of the mono camera are half as wide. */
export function smallRig(program, rig, place, eyes = 4) {
  wholeRig(program, rig, place)
  const [rigFile, tankFile] = [join(place, 'rig.yaml'), join(place, 'tank.xml')]
  if (rig !== 'tank-sim') {
    edit(rigFile, ['\nscan:\n', '\nscan:\n  control: {feedback_timeout_s: 1, heartbeat_timeout_s: 1}\n'], ['limit: 100,', 'limit: 0,'],
      ['heartbeat_output: {kind: bytes, device: runtime/box}', 'heartbeat_output: {kind: none}'], ['enable_input: {kind: reply, wait_s: 60}', 'enable_input: {kind: none}'],
      ['reply_timeout_ms: 5 ', 'silence_timeout_ms: 1000\n    reply_timeout_ms: 100 '])
    return
  }
  for (const [width, height, fx, fy, cx, cy, by] of [[640, 480, 765.4, 762.9, 315.7, 236.8, eyes], [720, 576, 626.08, 682.78, 368.93, 284.83, 2]]) {
    const whole = [width, height, fx, fy, cx, cy]
    const less = [width / by, height / by, fx / by, fy / by, (cx + 0.5) / by - 0.5, (cy + 0.5) / by - 0.5].map(value => Number(value.toFixed(4)))
    const model = of => `width_px: ${of[0]}, height_px: ${of[1]}, fx_px: ${of[2]}, fy_px: ${of[3]}, cx_px: ${of[4]}, cy_px: ${of[5]}`
    const size = of => `<resw>${of[0]}</resw><resh>${of[1]}</resh>`
    const lens = of => `<fx>${of[2]}</fx><fy>${of[3]}</fy><x0>${of[4]}</x0><y0>${of[5]}</y0>`
    edit(rigFile, [model(whole), model(less)])
    edit(tankFile, [size(whole), size(less)], [lens(whole), lens(less)])
  }
  edit(rigFile, ['\nscan:\n', '\nscan:\n  safety: {beam: {waived: [left, right]}}\n']) // too small to be witnesses
  edit(rigFile, ['\npresets:\n', '\npresets:\n  short: {sweep: {from_rad: 1.5, to_rad: 1.9}, dark_frames: 2}\n  long: {sweep: {passes: 5}, dark_frames: 2}\n'])
}
