// Small pieces of page: elements, and JSON as people read it.

type Child = Node | string

export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Partial<HTMLElementTagNameMap[K]> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const made = Object.assign(document.createElement(tag), properties)
  made.append(...children)
  return made
}

export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  const found = document.getElementById(id)
  if (!found) throw new Error(`the page has no ${id}`)
  return found as T
}

/** Never "-0.00". */
export const degrees = (value: number) => `${(Math.round(100 * value) / 100 + 0).toFixed(2)}°`

/** "0.15 mm", or that there is none. */
export const figure = (value: number | null, factor: number, digits: number, unit: string) => (value === null ? 'none' : `${(factor * value).toFixed(digits)} ${unit}`)

const words = (key: string) => key.replace(/_/g, ' ')

function plain(value: unknown): string {
  if (typeof value === 'number') return Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(5)))
  if (typeof value === 'boolean') return value ? 'yes' : 'no'
  return value === null || value === undefined ? '--' : String(value)
}

/** What a person must see at once: verdicts, and what is refused. The words say the same as the colours. */
function judgement(key: string, value: unknown): string {
  if (key === 'verdict') return value === 'bad' ? 'bad' : value === 'good' ? 'good' : ''
  return (key === 'refused' && value === true) || (key === 'can_run' && value === false) ? 'bad' : ''
}

function cell(key: string, value: unknown): HTMLTableCellElement {
  const td = make('td', { className: typeof value === 'number' ? 'number' : '' })
  const judged = judgement(key, value)
  td.append(typeof value === 'object' && value !== null ? shown(value) : judged ? make('strong', { className: judged }, plain(value)) : plain(value))
  return td
}

/** Any JSON: a table of a list of objects, a table of two columns of an object, else its text. */
export function shown(value: unknown): HTMLElement {
  if (Array.isArray(value)) {
    if (value.length === 0) return make('span', {}, 'none')
    if (value.every(v => typeof v !== 'object' || v === null)) return make('span', {}, value.map(plain).join(', '))
    const keys = [...new Set(value.flatMap(v => (typeof v === 'object' && v !== null ? Object.keys(v) : [])))]
    const head = make('tr', {}, ...keys.map(k => make('th', {}, words(k))))
    const rows = value.map(v => make('tr', {}, ...keys.map(k => cell(k, (v as Record<string, unknown>)[k]))))
    return make('div', { className: 'scroll' }, make('table', {}, make('thead', {}, head), make('tbody', {}, ...rows)))
  }
  if (typeof value === 'object' && value !== null) {
    const rows = Object.entries(value).map(([k, v]) => make('tr', {}, make('th', { scope: 'row' }, words(k)), cell(k, v)))
    return make('table', {}, make('tbody', {}, ...rows))
  }
  return make('span', {}, plain(value))
}

/** What the server answers to a question; its own words where it cannot. */
export async function ask(question: string): Promise<unknown> {
  const answer = await fetch(`/api/${question}`)
  if (!answer.ok) throw new Error((await answer.text()).trim())
  return answer.json()
}

/** A terminal's text as lines: a carriage return begins the line anew, colours are left out. */
export class Terminal {
  private lines: string[] = ['']
  private rest = ''

  add(text: string): string {
    const all = (this.rest + text).replace(/\x1b\[[0-9;?]*[A-Za-z]/g, '')
    const cut = all.lastIndexOf('\x1b')
    this.rest = cut >= 0 ? all.slice(cut) : ''
    for (const c of cut >= 0 ? all.slice(0, cut) : all) {
      if (c === '\n') this.lines.push('')
      else if (c === '\r') this.back = true
      else {
        if (this.back) this.lines[this.lines.length - 1] = ''
        this.lines[this.lines.length - 1] += c
      }
      if (c !== '\r') this.back = false
    }
    this.lines = this.lines.slice(-400)
    return this.lines.join('\n')
  }

  clear(): void {
    this.lines = ['']
    this.rest = ''
  }

  private back = false
}
