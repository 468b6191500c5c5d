# Puts three.js's licence before the bundle.
file(READ ${WEB}/node_modules/three/LICENSE licence)
file(READ ${WEB}/console.js program)
file(WRITE ${OUT} "/* The drawing in 3D is done by three.js:\n\n${licence}*/\n${program}")
