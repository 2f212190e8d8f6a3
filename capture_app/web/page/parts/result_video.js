// The video of a motion, which is drawn after the motion is there.
import { api, inWords } from "../core/api.js";
import { h, hintLine, part, put } from "../core/dom.js";
import { poll } from "../core/poll.js";
import { ended } from "../core/words.js";
import { trouble } from "./trouble.js";
/** @import {Job, Result} from "../core/answers.js" */

/** The video, or how far it is: the motion does not wait for it.
 *  @param {Result} item @param {AbortSignal} signal */
export function resultVideo(item, signal) {
  if (!item.video && !item.video_job) return null;
  const place = h("div", {}, item.video && watched(item, item.video));
  if (!item.video) follow(item, place, signal);
  return part("Video", place);
}

/** @param {Result} item @param {string} video */
function watched(item, video) {
  return [
    h("video", { controls: true, preload: "auto", src: video, class: "film" }),
    h("p", {}, h("a", { href: video, download: `${item.name}.mp4` }, "Download the video")),
  ];
}

/** Tell how far the video is, and show it when it is there.
 *  @param {Result} item @param {Element} place @param {AbortSignal} signal */
function follow(item, place, signal) {
  const bar = h("progress", { max: 1, value: 0, "aria-label": "Progress of the video" });
  put(place, hintLine("The video is being drawn."), bar);
  poll(
    async () => {
      /** @type {Job} */
      const job = await api(`/api/jobs/${item.video_job}`, { signal });
      bar.value = job.fraction;
      if (!ended(job)) return false;
      /** @type {Result} */
      const now = await api(`/api/results/${item.id}`, { signal });
      put(place, now.video ? watched(now, now.video) : job.error && trouble(job.error));
      return true;
    },
    1000,
    signal,
    (error) => put(place, trouble(inWords(error))),
  );
}
