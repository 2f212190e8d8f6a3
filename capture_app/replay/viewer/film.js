// The phone's film: an image that shows the picture of a moment.

import { element } from "./elements.js";
/** @import {Pack} from "./pack.js" */

/** {element, time, dispose()}; null where the phone filmed nothing. @param {Pack} pack */
export function createFilm(pack) {
  return pack.array("film_times")?.length ? new Film(pack) : null;
}

export class Film {
  /** @param {Pack} pack */
  constructor(pack) {
    this.times = pack.need("film_times");
    this.offsets = pack.need("film_offsets");
    this.jpeg = pack.need("film_jpeg");
    this.element = element("img", { alt: "What the phone filmed at this moment" });
    this.shown = -1;
    /** @type {Map<number, string>} */
    this.places = new Map();
    this.time = 0;
  }

  /** Seconds of the scene. @param {number} seconds */
  set time(seconds) {
    const index = nearest(this.times, seconds);
    if (index === this.shown) return;
    this.shown = index;
    this.element.src = this.#place(index);
  }

  dispose() {
    this.places.forEach((place) => URL.revokeObjectURL(place));
    this.places.clear();
  }

  /** @param {number} index */
  #place(index) {
    const known = this.places.get(index);
    if (known) return known;
    const bytes = this.jpeg.subarray(this.offsets[index], this.offsets[index + 1]);
    const place = URL.createObjectURL(new Blob([bytes], { type: "image/jpeg" }));
    this.places.set(index, place);
    return place;
  }
}

/** Index of the time that is nearest to a moment; `times` ascend.
 *  @param {ArrayLike<number>} times @param {number} time */
export function nearest(times, time) {
  let low = 0;
  let high = times.length - 1;
  while (low < high) {
    const half = (low + high) >> 1;
    if (times[half] < time) low = half + 1;
    else high = half;
  }
  const before = Math.max(0, low - 1);
  return time - times[before] < times[low] - time ? before : low;
}
