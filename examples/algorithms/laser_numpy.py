#!/usr/bin/python3
"""A laser method in Python with numpy, for <algorithm>: laser_numpy.py SESSION CLOUD.ply

Takes the dark frames' median off each frame of the sweep, finds the brightest row of each column, takes the centroid around
it, and cuts the pixel's ray with that frame's laser plane. Needs Debian's python3-numpy, python3-yaml and python3-pil."""
import csv
import os
import sys

import numpy as np
import yaml
from PIL import Image

HALF = 4         # rows on either side of the brightest one
LEAST = 60.0     # grey levels, red, green and blue together, that a peak stands above the dark frames


def picture(session, row):
    return np.asarray(Image.open(os.path.join(session, row["file"])), dtype=np.float32).sum(axis=2)


def rotation(q):
    x, y, z, w = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def rays(model, column, row):
    """Directions (x, y, 1) of pixels, their distortion undone by iteration."""
    xd, yd = (column - model["cx_px"]) / model["fx_px"], (row - model["cy_px"]) / model["fy_px"]
    x, y = xd.copy(), yd.copy()
    for _ in range(20):
        r2 = x * x + y * y
        radial = 1 + r2 * (model["k1"] + r2 * (model["k2"] + r2 * model["k3"]))
        dx = 2 * model["p1"] * x * y + model["p2"] * (r2 + 2 * x * x)
        dy = model["p1"] * (r2 + 2 * y * y) + 2 * model["p2"] * x * y
        x, y = (xd - dx) / radial, (yd - dy) / radial
    return np.stack([x, y, np.ones_like(x)], axis=1)


def stripe(image):
    """Column and row of the stripe, in each column that shows one."""
    peak = image.argmax(axis=0)
    columns = np.arange(image.shape[1])
    good = (image[peak, columns] > LEAST) & (peak >= HALF) & (peak < image.shape[0] - HALF)
    columns, peak = columns[good], peak[good]
    rows = peak + np.arange(-HALF, HALF + 1)[:, None]
    weight = np.maximum(image[rows, columns], 0)
    return columns.astype(float), (weight * rows).sum(axis=0) / weight.sum(axis=0)


def main(session, cloud):
    with open(os.path.join(session, "session.yaml")) as file:
        camera = next(c for c in yaml.safe_load(file)["cameras"] if c["role"] == "mono")
    with open(os.path.join(session, "frames.csv")) as file:
        frames = [f for f in csv.DictReader(file) if f["camera"] == camera["name"]]
    dark = [picture(session, f) for f in frames if f["laser_on"] == "0"][:9]
    background = np.median(dark, axis=0) if dark else 0
    bMc, points = camera["bMc"], []
    for frame in frames:
        if frame["laser_on"] == "0":
            continue
        direction = rays(camera["model"], *stripe(picture(session, frame) - background))
        normal = np.array([float(frame["plane_" + k]) for k in "abc"])
        distance = -float(frame["plane_d_m"]) / (direction @ normal)
        seen = (distance > 0) & (distance < 20)
        in_camera = distance[seen, None] * direction[seen]
        in_base = in_camera @ rotation(bMc["quaternion_xyzw"]).T + np.array(bMc["translation_m"])
        points.append(np.column_stack([in_base, np.full(len(in_base), float(frame["index"]))]))
    table = np.concatenate(points) if points else np.zeros((0, 4))
    record = np.zeros(len(table), dtype=[("p", "<f4", 3), ("frame", "<i4")])
    record["p"], record["frame"] = table[:, :3], table[:, 3]
    with open(cloud, "wb") as file:
        file.write((f"ply\nformat binary_little_endian 1.0\ncomment frame b\nelement vertex {len(record)}\nproperty float x\n"
                    "property float y\nproperty float z\nproperty int frame\nend_header\n").encode())
        file.write(record.tobytes())


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: laser_numpy.py SESSION CLOUD.ply")
    main(sys.argv[1], sys.argv[2])
