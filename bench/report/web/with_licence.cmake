# Puts the licence of LIBRARY before the bundle NAME.
file(READ ${WEB}/node_modules/${LIBRARY}/LICENSE licence)
file(READ ${WEB}/${NAME}.js program)
file(WRITE ${OUT} "/* The drawing is done by ${LIBRARY}:\n\n${licence}\n*/\n${program}")
