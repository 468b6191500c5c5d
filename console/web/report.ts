// A report in a frame that has none of the page's rights. It may ask for a file beside it, which opens in a tab of its own.
import { make } from './page'

const beside = /^((clouds|results)\/[\w.-]+|sessions\/[\w.-]+\/report\.html)$/
const frames = new Set<HTMLIFrameElement>()

window.addEventListener('message', event => {
  const file = (event.data as { open?: unknown } | null)?.open
  if (typeof file !== 'string' || !beside.test(file)) return
  for (const frame of frames)
    if (!frame.isConnected) frames.delete(frame)
    else if (event.source === frame.contentWindow) make('a', { href: new URL(file, frame.src).href, target: '_blank', rel: 'noopener' }).click()
})

export function reportFrame(address: string, title: string): HTMLIFrameElement {
  const frame = make('iframe', { title, src: address })
  frame.setAttribute('sandbox', 'allow-scripts')
  frames.add(frame)
  return frame
}

/** Where the server shows a file that a command has named; nothing if it does not. */
export const addressOf = (file: string): string | undefined =>
  /^(sessions|benchmarks|experiments)\//.test(file) ? `/${file.split('/').map(encodeURIComponent).join('/')}` : undefined
