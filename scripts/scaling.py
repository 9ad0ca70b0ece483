#!/usr/bin/env python3
"""How long a job takes with 1, 10, 100 and 1,000 workers, by simulation.

Every figure of the program was measured: docs/measurements/2026-11-24-cluster-scaling.md. Those of an image are given for each
pixel, so they scale with its size. The network and the engine are assumptions, named below.

    scripts/scaling.py [--network GBIT] [--storage GBIT] [--start SECONDS]

A worker is one core. Prints tables for a 4K still, in parts by samples and by tiles, and for 600 frames.
"""

import argparse
import heapq

MPIXEL = 1e6
STILL = 3840 * 2160 / MPIXEL
FRAME = 1920 * 1080 / MPIXEL

# Measured, one thread, CPU seconds.
FIXED = {"gallery": 0.47, "cornell": 0.02, "carousel": 0.08}  # loading, trees and the pilot of a part
FILM = {"gallery": 0.54, "cornell": 0.55, "carousel": 0.68}  # for each megapixel of a part: buffers, packing, writing
SAMPLE = {"gallery": 0.41, "cornell": 0.095, "carousel": 0.143}  # for each megapixel and sample
BYTES = {"gallery": 63e6, "cornell": 32e6}  # for each megapixel of the film of a part by samples
TILE_FILM = 0.40  # as FILM, for each megapixel of the whole image, for a part by tiles
TILE_BYTES = 2.4e6  # for each megapixel of the whole image, beside the part's own pixels
MERGE = {"samples": 0.30, "tiles": 0.23}  # for each megapixel of a film that is added

# An assumption: an image of eight bits without compression.
FRAME_BYTES = 3e6  # for each megapixel

def parts(workers, n, start, network, storage, compute, load):
    """Seconds until n parts are done: each takes `compute` seconds, and writes `load` bytes to a shared storage."""
    free = [start] * min(workers, n)
    heapq.heapify(free)
    storage_free, end = 0.0, 0.0
    for _ in range(n):
        begin = heapq.heappop(free)
        done = begin + compute
        # Its own line, and its turn at the storage; whichever takes longer.
        storage_free = max(storage_free, done) + load / storage
        done = max(done + load / network, storage_free)
        heapq.heappush(free, done)
        end = max(end, done)
    return end


def merge(n, by, load, network):
    """Seconds to read and add n films of a 4K still on one machine."""
    return n * max(load / network, MERGE[by] * STILL)


def still(workers, scene, by, spp, options):
    """Seconds for rendering and for merging a 4K still of one part for each worker."""
    network, storage = options.network * 1e9 / 8, options.storage * 1e9 / 8
    if by == "samples":
        compute = FIXED[scene] + STILL * (FILM[scene] + SAMPLE[scene] * spp / workers)
        load = BYTES[scene] * STILL
    else:
        compute = FIXED[scene] + STILL * (TILE_FILM + SAMPLE[scene] * spp / workers)
        load = STILL * (TILE_BYTES + BYTES[scene] / workers)
    if workers == 1:
        return compute, 0.0
    rendered = parts(workers, workers, options.start, network, storage, compute, load)
    # In groups of the square root; the groups work at the same time and share the storage.
    groups = max(1, round(workers**0.5))
    each = -(-workers // groups)
    first = max(merge(each, by, load, network), workers * load / storage)
    second = merge(groups, "samples", BYTES[scene] * STILL, network)
    one_step = merge(workers, by, load, network)
    return rendered, min(one_step, options.start + first + second)


def frames(workers, n, spp, options):
    """Seconds for n frames, divided evenly."""
    network, storage = options.network * 1e9 / 8, options.storage * 1e9 / 8
    each = -(-n // min(workers, n))
    compute = FIXED["carousel"] + each * FRAME * (FILM["carousel"] + SAMPLE["carousel"] * spp)
    return parts(workers, min(workers, n), options.start, network, storage, compute, each * FRAME * FRAME_BYTES)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--network", type=float, default=10, help="gigabits per second of one machine")
    parser.add_argument("--storage", type=float, default=40, help="gigabits per second of the shared storage")
    parser.add_argument("--start", type=float, default=5, help="seconds until the engine has started a part")
    options = parser.parse_args()
    counts = (1, 10, 100, 1000)
    for scene, by in (("gallery", "samples"), ("cornell", "samples"), ("cornell", "tiles")):
        for spp in (1024, 16384):
            print(f"{scene}, 3840 x 2160, {spp} samples per pixel, parts by {by}")
            alone = still(1, scene, by, spp, options)[0]
            for workers in counts:
                rendered, merged = still(workers, scene, by, spp, options)
                whole = rendered + merged
                print(f"  {workers:5} workers: {rendered:8.0f} s + merge {merged:6.0f} s, {alone / whole:6.1f} times")
    print("carousel, 600 frames of 1920 x 1080, 256 samples per pixel")
    alone = frames(1, 600, 256, options)
    for workers in counts:
        whole = frames(workers, 600, 256, options)
        print(f"  {workers:5} workers: {whole:8.0f} s, {alone / whole:6.1f} times")


if __name__ == "__main__":
    main()
