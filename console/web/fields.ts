// The fields of a command's form.
import { Field } from './messages'
import { make } from './page'

export function fieldOf(field: Field): HTMLElement {
  const name = field.key
  const list = field.choices.length > 0
  const label = (value: string) => value.split('/').pop() ?? value
  const input = list
    ? make('select', { name }, ...(field.required ? [] : [make('option', { value: '' }, 'as the rig file says')]), ...field.choices.map(c => make('option', { value: c }, label(c))))
    : make('input', { name, type: field.kind === 'text' || field.kind === 'folder' ? 'text' : 'number', required: field.required })
  const notes: HTMLElement[] = field.help ? [make('small', {}, field.help)] : []
  if (input instanceof HTMLInputElement && field.number) notes.push(refusing(input, field.number))
  return make('label', {}, field.label, ' ', input, ...notes)
}

/** Refuses a number where it is typed, in the words in which the command would; returns the place for them. */
function refusing(input: HTMLInputElement, { least, most, whole, expected }: NonNullable<Field['number']>): HTMLElement {
  const says = make('small', { className: 'bad' })
  says.setAttribute('role', 'status')
  input.step = 'any'
  input.addEventListener('input', () => {
    const value = input.valueAsNumber
    const fits = input.value === '' ? !input.validity.badInput : value >= (least ?? -Infinity) && value <= (most ?? Infinity) && (!whole || Number.isInteger(value))
    const found = input.validity.badInput ? 'no number' : `'${input.value}'`
    says.textContent = fits ? '' : `found ${found}, expected ${expected}`
    input.setCustomValidity(says.textContent)
    input.setAttribute('aria-invalid', String(!fits))
  })
  return says
}

/** Nothing where a field is wrong; the browser shows which. */
export function valuesOf(page: HTMLFormElement, fields: Field[]): Record<string, unknown> | undefined {
  if (!page.reportValidity()) return undefined
  const out: Record<string, unknown> = {}
  for (const field of fields) {
    const input = page.elements.namedItem(field.key)
    if ((input instanceof HTMLInputElement || input instanceof HTMLSelectElement) && input.value !== '')
      out[field.key] = input.type === 'number' ? Number(input.value) : input.value
  }
  return out
}
