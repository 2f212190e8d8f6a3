// Where the scenes of a replay page come from: the page itself, or the server that it came from.

export async function readScenes() {
  const inside = [...document.querySelectorAll("script[data-scene]")];
  if (inside.length) return Promise.all(inside.map((holder) => unpacked(holder.textContent ?? "")));
  const places = new URLSearchParams(location.search).getAll("scene");
  return Promise.all(places.map(fetched));
}

/** @param {string} text */
async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

/** @param {string} place */
async function fetched(place) {
  const url = new URL(place, location.href);
  if (url.origin !== location.origin) throw new Error("The scene is on another server.");
  const answer = await fetch(url);
  if (answer.ok) return answer.arrayBuffer();
  const told = await answer.json().catch(() => null);
  throw new Error(told?.error?.what ?? `The server answers ${answer.status}.`);
}
