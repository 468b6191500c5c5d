// A WebSocket that only listens: what it got is counted, pings are answered, nothing is drawn.
import http from 'node:http'
import https from 'node:https'

/** `address` and `cookie` as a browser has them. Resolves when the connection stands. */
export function watch(address, cookie) {
  const { protocol, hostname, port, origin } = new URL(address)
  const headers = {
    Cookie: cookie, Origin: origin, Connection: 'Upgrade', Upgrade: 'websocket', 'Sec-WebSocket-Version': '13',
    'Sec-WebSocket-Key': Buffer.alloc(16).toString('base64'),
  }
  return new Promise((done, failed) => {
    const request = (protocol === 'https:' ? https : http).request({ hostname, port, path: '/live', headers, rejectUnauthorized: false })
    request.on('error', failed)
    request.on('response', response => failed(new Error(`refused: ${response.statusCode}`)))
    request.on('upgrade', (_, socket, head) => done(new Watcher(socket, head)))
    request.end()
  })
}

class Watcher {
  points = 0
  pictures = 0
  texts = []
  closed = false

  constructor(socket, head) {
    this.socket = socket
    this.bytes = head
    socket.on('data', data => {
      this.bytes = this.bytes.length > 0 ? Buffer.concat([this.bytes, data]) : data
      while (this.frame());
    })
    for (const end of ['close', 'error']) socket.on(end, () => { this.closed = true })
    while (this.frame());
  }

  /** One frame of RFC 6455, a whole message; false if it is not there yet. */
  frame() {
    const { bytes } = this
    if (bytes.length < 2) return false
    let at = 2
    let length = bytes[1] & 0x7f
    if (length === 126) { if (bytes.length < 4) return false; length = bytes.readUInt16BE(2); at = 4 }
    else if (length === 127) { if (bytes.length < 10) return false; length = Number(bytes.readBigUInt64BE(2)); at = 10 }
    if (bytes.length < at + length) return false
    this.take(bytes[0] & 0x0f, bytes.subarray(at, at + length))
    this.bytes = bytes.subarray(at + length)
    return true
  }

  take(kind, data) {
    if (kind === 1) this.texts.push(JSON.parse(data.toString()))
    else if (kind === 2 && data[0] === 0x4c) this.points += (data.length - 9) / 12
    else if (kind === 2) ++this.pictures
    else if (kind === 9) this.send(0x8a, data)
  }

  say(message) { this.send(0x81, Buffer.from(JSON.stringify(message))) }

  send(first, data) {
    this.socket.write(Buffer.concat([Buffer.from([first, 0x80 | data.length, 0, 0, 0, 0]), data]))  // masked by zeros
  }

  last(is) { return this.texts.filter(text => text.is === is).at(-1) }

  end() { this.socket.destroy() }
}
