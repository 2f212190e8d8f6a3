// How time goes on while a scene plays.

/** Where `seconds` more of playing lead, and whether it stops there.
 *  @param {number} time @param {number} seconds @param {number[]} stretch its start and end in seconds
 *  @param {boolean} loop */
export function playedOn(time, seconds, [start, end], loop) {
  const next = time + seconds;
  if (next <= end) return { time: next, stops: false };
  if (loop) return { time: start + ((next - start) % (end - start)), stops: false };
  return { time: end, stops: true };
}
