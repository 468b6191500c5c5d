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

/** Where only the way matters: a simulated rig with small stereo pictures; one on wires that is patient with a busy machine. */
export function smallRig(program, rig, place) {
  const wires = rig !== 'tank-sim'
  execFileSync(program, ['init', place, '--from', rig], { stdio: 'ignore' })
  const edit = (file, ...pairs) => {
    let text = readFileSync(join(place, file), 'utf8')
    for (const [from, to] of pairs) {
      assert.ok(text.includes(from), `${file} has no ${from}`)
      text = text.replaceAll(from, to)
    }
    writeFileSync(join(place, file), text)
  }
  if (wires)
    edit('rig.yaml', ['\nscan:\n', '\nscan:\n  control: {feedback_timeout_s: 1, heartbeat_timeout_s: 1}\n'], ['limit: 100,', 'limit: 0,'],
      ['heartbeat_output: {kind: bytes, device: runtime/box}', 'heartbeat_output: {kind: none}'], ['enable_input: {kind: reply, wait_s: 60}', 'enable_input: {kind: none}'],
      ['reply_timeout_ms: 5 ', 'silence_timeout_ms: 1000\n    reply_timeout_ms: 100 '])
  else {
    edit('rig.yaml', ['width_px: 640, height_px: 480, fx_px: 765.4, fy_px: 762.9, cx_px: 315.7, cy_px: 236.8',
      'width_px: 160, height_px: 120, fx_px: 191.35, fy_px: 190.725, cx_px: 78.55, cy_px: 58.825'])
    edit('tank.xml', ['<resw>640</resw><resh>480</resh>', '<resw>160</resw><resh>120</resh>'],
      ['<fx>765.4</fx><fy>762.9</fy><x0>315.7</x0><y0>236.8</y0>', '<fx>191.35</fx><fy>190.725</fy><x0>78.55</x0><y0>58.825</y0>'])
  }
  return place
}
