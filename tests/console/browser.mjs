// The browser that the console's tests drive.
import { createRequire } from 'node:module'
import { join } from 'node:path'

/** `web` holds node_modules. Only WebGL needs the emulated GPU: pages composed without it cost a quarter less. */
export const launchBrowser = (web, executablePath, args = []) =>
  createRequire(join(web, 'package.json'))('playwright-core').chromium.launch({
    executablePath, args: ['--no-sandbox', '--disable-gpu-compositing', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', ...args],
  })
