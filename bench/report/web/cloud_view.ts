// The clouds of a report in 3D: over the object, with the cameras and the arm. Reads what bench/report/cloud_view.hpp
// writes into the page, and loads nothing.
//
// Frame: o, the object's; z up. Units: metres.
import * as THREE from 'three'
import { OrbitControls } from 'three/addons/controls/OrbitControls.js'

interface Cloud {
  name: string
  step_m: number // of one unit of `points`
  points: string // base64 of int16 x, y, z
  verdicts: string // base64 of uint8: PointVerdict
  shown: number
  all: number // before it was thinned
}

interface Lines {
  name: string
  points: number[][] // a polyline [m]
}

interface Scene {
  vertices: number[][]
  triangles: number[][]
  clouds: Cloud[]
  rig: Lines[]
}

// In the order of PointVerdict.
const verdicts = [
  { name: 'ground', colour: 0x101010 },
  { name: 'object', colour: 0x00b400 },
  { name: 'outlier', colour: 0x1414ff },
  { name: 'rejected', colour: 0xb0b0b0 },
]

function bytes(base64: string): Uint8Array {
  const text = atob(base64)
  const out = new Uint8Array(text.length)
  for (let i = 0; i < text.length; ++i) out[i] = text.charCodeAt(i)
  return out
}

/** One set of points for each verdict, so that each can be hidden. */
function pointsOf(cloud: Cloud): THREE.Points[] {
  const data = bytes(cloud.points)
  const values = new Int16Array(data.buffer, 0, data.length / 2)
  const of = bytes(cloud.verdicts)
  return verdicts.map((verdict, kind) => {
    const place: number[] = []
    for (let i = 0; i < of.length; ++i)
      if (of[i] === kind)
        for (let axis = 0; axis < 3; ++axis) place.push(values[3 * i + axis] * cloud.step_m)
    const geometry = new THREE.BufferGeometry()
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(place, 3))
    const material = new THREE.PointsMaterial({ color: verdict.colour, size: 2, sizeAttenuation: false })
    const points = new THREE.Points(geometry, material)
    points.userData = { verdict: verdict.name }
    return points
  })
}

function meshOf(scene: Scene): THREE.Group {
  const geometry = new THREE.BufferGeometry()
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(scene.vertices.flat(), 3))
  geometry.setIndex(scene.triangles.flat())
  geometry.computeVertexNormals()
  const surface = new THREE.MeshBasicMaterial({
    color: 0xd8d8d8,
    side: THREE.DoubleSide,
    polygonOffset: true, // points on the surface stay visible
    polygonOffsetFactor: 2,
    polygonOffsetUnits: 2,
  })
  const group = new THREE.Group()
  group.add(new THREE.Mesh(geometry, surface))
  group.add(
    new THREE.LineSegments(new THREE.EdgesGeometry(geometry, 20), new THREE.LineBasicMaterial({ color: 0x606060 })),
  )
  return group
}

function rigOf(scene: Scene): THREE.Group {
  const group = new THREE.Group()
  for (const lines of scene.rig) {
    const geometry = new THREE.BufferGeometry().setFromPoints(lines.points.map(p => new THREE.Vector3(...p)))
    group.add(new THREE.Line(geometry, new THREE.LineBasicMaterial({ color: lines.name === 'arm' ? 0xb8a000 : 0xd06000 })))
  }
  return group
}

function element<K extends keyof HTMLElementTagNameMap>(tag: K, text = ''): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag)
  made.textContent = text
  return made
}

/** A labelled checkbox or radio button. */
function control(type: 'checkbox' | 'radio', text: string, checked: boolean, changed: (on: boolean) => void): HTMLElement {
  const label = element('label')
  const input = element('input')
  input.type = type
  input.checked = checked
  if (type === 'radio') input.name = 'cloud'
  input.addEventListener('change', () => changed(input.checked))
  label.append(input, ' ', text)
  label.style.marginRight = '1rem'
  return label
}

function start(place: HTMLElement, data: Scene): void {
  const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true })
  renderer.setClearColor(0xffffff)
  const canvas = renderer.domElement
  canvas.tabIndex = 0
  canvas.setAttribute('role', 'img')
  canvas.setAttribute('aria-label', 'The clouds over the object, in 3D. Arrow keys turn, plus and minus zoom.')
  canvas.style.cssText = 'display:block;width:100%;border:1px solid #ddd;touch-action:none'

  const world = new THREE.Scene()
  const mesh = meshOf(data)
  const rig = rigOf(data)
  rig.visible = false
  world.add(mesh, rig)

  const box = new THREE.Box3().setFromObject(mesh)
  const middle = box.getCenter(new THREE.Vector3())
  const size = box.getSize(new THREE.Vector3()).length()
  const camera = new THREE.PerspectiveCamera(40, 1, size / 100, size * 100)
  camera.up.set(0, 0, 1)
  const controls = new OrbitControls(camera, canvas)
  const draw = () => renderer.render(world, camera)
  const home = () => {
    const eye = data.rig.find(lines => lines.name !== 'arm')?.points[0]
    const towards = eye ? new THREE.Vector3(...eye).sub(middle) : new THREE.Vector3(-1, -1, 1)
    camera.position.copy(middle).addScaledVector(towards.normalize(), 1.9 * size)
    controls.target.copy(middle)
    controls.update()
    draw()
  }
  controls.addEventListener('change', draw)

  const said = element('p')
  let shown: THREE.Points[] = []
  const hidden = new Set<string>(['rejected'])
  const show = (cloud: Cloud) => {
    for (const points of shown) {
      world.remove(points)
      points.geometry.dispose()
    }
    shown = pointsOf(cloud)
    for (const points of shown) {
      points.visible = !hidden.has(points.userData.verdict)
      world.add(points)
    }
    said.textContent =
      cloud.shown < cloud.all
        ? `${cloud.name}: ${cloud.shown} of ${cloud.all} points, evenly thinned`
        : `${cloud.name}: all of its ${cloud.all} points`
    draw()
  }

  const choices = element('p')
  data.clouds.forEach((cloud, i) => choices.append(control('radio', cloud.name, i === 0, () => show(cloud))))
  const parts = element('p')
  for (const { name } of verdicts)
    parts.append(
      control('checkbox', name, !hidden.has(name), on => {
        if (on) hidden.delete(name)
        else hidden.add(name)
        for (const points of shown) points.visible = !hidden.has(points.userData.verdict)
        draw()
      }),
    )
  parts.append(control('checkbox', "the object's mesh", true, on => { mesh.visible = on; draw() }))
  parts.append(control('checkbox', 'cameras and arm', false, on => { rig.visible = on; draw() }))
  const back = element('button', 'Reset the view')
  back.type = 'button'
  back.addEventListener('click', home)
  parts.append(back)
  place.append(choices, canvas, parts, said)

  canvas.addEventListener('keydown', event => {
    const turn = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key]
    const zoom = { '+': 0.9, '-': 1 / 0.9 }[event.key]
    if (!turn && !zoom) return
    event.preventDefault()
    const arm = camera.position.clone().sub(controls.target)
    const ball = new THREE.Spherical().setFromVector3(new THREE.Vector3(arm.x, arm.z, -arm.y))
    if (turn) {
      ball.theta += 0.1 * turn[0]
      ball.phi = Math.min(Math.PI - 0.01, Math.max(0.01, ball.phi + 0.1 * turn[1]))
    }
    if (zoom) ball.radius *= zoom
    const to = new THREE.Vector3().setFromSpherical(ball)
    camera.position.copy(controls.target).add(new THREE.Vector3(to.x, -to.z, to.y))
    controls.update()
    draw()
  })

  const fit = () => {
    const width = place.clientWidth
    const height = Math.round(Math.min(0.62 * width, 0.8 * window.innerHeight))
    renderer.setPixelRatio(Math.min(2, window.devicePixelRatio))
    renderer.setSize(width, height, false)
    canvas.style.height = `${height}px`
    camera.aspect = width / height
    camera.updateProjectionMatrix()
    draw()
  }
  new ResizeObserver(fit).observe(place)
  home()
  if (data.clouds.length > 0) show(data.clouds[0])
  fit()
}

const place = document.getElementById('cloud-view')
const data = document.getElementById('cloud-data')
if (place && data?.textContent) {
  try {
    start(place, JSON.parse(data.textContent) as Scene)
  } catch (error) {
    place.textContent = `This browser cannot draw in 3D (${String(error)}). The pictures below show the same clouds.`
  }
}
