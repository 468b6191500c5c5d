// TANKRIG_PICTURES=FOLDER keeps pictures of the pages that a test meets, as a desk and as a tablet show them.
import { join } from 'node:path'

export const pictures = process.env.TANKRIG_PICTURES

/** NAME.png, 1280 pixels wide, and NAME_800.png. */
export async function keep(page, name) {
  if (!pictures) return
  const before = page.viewportSize()
  for (const [width, height, as] of [[1280, 900, name], [800, 1000, `${name}_800`]]) {
    await page.setViewportSize({ width, height })
    await page.evaluate(() => window.scrollTo(0, 0))
    await page.waitForTimeout(500) // 3D views are drawn anew
    await page.screenshot({ path: join(pictures, `${as}.png`), fullPage: true })
  }
  await page.setViewportSize(before)
}
