# Puts the licence of LIBRARY before a bundle.
file(READ ${WEB}/node_modules/${LIBRARY}/LICENSE licence)
file(READ ${BUNDLE} program)
file(WRITE ${OUT} "/* The drawing is done by ${LIBRARY}:\n\n${licence}\n*/\n${program}")
