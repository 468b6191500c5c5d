// Clouds as tankrig writes them: binary PLY, and the same as a table.
export type Fields = Record<string, Float32Array>

const readers: Record<string, [number, (view: DataView, at: number) => number]> = {
  float: [4, (view, at) => view.getFloat32(at, true)],
  int: [4, (view, at) => view.getInt32(at, true)],
  uchar: [1, (view, at) => view.getUint8(at)],
}

/** A binary PLY as tankrig writes it, evenly thinned to at most `most` points. */
export function fieldsOf(data: ArrayBuffer, most = Infinity): Fields {
  const head = new TextDecoder('latin1').decode(data.slice(0, 2000))
  const end = head.indexOf('end_header\n')
  const count = Number(/element vertex (\d+)/.exec(head)?.[1] ?? NaN)
  const properties = [...head.slice(0, end).matchAll(/property (\w+) (\w+)/g)].map(match => ({ type: match[1], name: match[2] }))
  const stride = properties.reduce((sum, p) => sum + (readers[p.type]?.[0] ?? NaN), 0)
  const body = end + 'end_header\n'.length
  if (end < 0 || !head.includes('binary_little_endian') || !(body + count * stride <= data.byteLength)) throw new Error('no PLY that can be shown')
  const view = new DataView(data, body)
  const step = Math.max(1, Math.ceil(count / most))
  const kept = Math.ceil(count / step)
  const fields: Fields = {}
  let offset = 0
  for (const { type, name } of properties) {
    const [size, read] = readers[type]
    const values = new Float32Array(kept)
    for (let i = 0; i < kept; ++i) values[i] = read(view, i * step * stride + offset)
    fields[name] = values
    offset += size
  }
  return fields
}

/** A line for each point, in pieces; numbers as short as they are exact. */
export function csvOf(data: ArrayBuffer): string[] {
  const fields = fieldsOf(data)
  const columns = Object.values(fields)
  const pieces = [`${Object.keys(fields).join(',')}\n`]
  for (let i = 0; i < (columns[0]?.length ?? 0); ++i)
    pieces.push(`${columns.map(column => (Number.isInteger(column[i]) ? column[i] : column[i].toPrecision(9))).join(',')}\n`)
  return pieces
}
