// The browser of the console's tests: its pages are drawn by the processor, so that several tests and a scan share two.
import { createRequire } from 'node:module'
import { join } from 'node:path'

/** `web` holds node_modules. Pages are composed without the emulated GPU, which WebGL alone needs: a quarter less work. */
export const launchBrowser = (web, executablePath, args = []) =>
  createRequire(join(web, 'package.json'))('playwright-core').chromium.launch({
    executablePath, args: ['--no-sandbox', '--disable-gpu-compositing', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', ...args],
  })
