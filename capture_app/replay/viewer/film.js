// The phone's film: an image that shows the picture of a moment.

import { element } from "./elements.js";
/** @import {Pack} from "./pack.js" */

/** {element, time, dispose()}; null where the phone filmed nothing. @param {Pack} pack */
export function createFilm(pack) {
  return pack.array("film_times")?.length ? new Film(pack) : null;
}

class Film {
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
    const index = this.#nearest(seconds);
    if (index === this.shown) return;
    this.shown = index;
    this.element.src = this.#place(index);
  }

  dispose() {
    this.places.forEach((place) => URL.revokeObjectURL(place));
    this.places.clear();
  }

  /** @param {number} time */
  #nearest(time) {
    let low = 0;
    let high = this.times.length - 1;
    while (low < high) {
      const half = (low + high) >> 1;
      if (this.times[half] < time) low = half + 1;
      else high = half;
    }
    const before = Math.max(0, low - 1);
    return time - this.times[before] < this.times[low] - time ? before : low;
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
