"""The script of a rater's page: shows the pairs, takes the choices, saves them as a file."""

SCRIPT = """
"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const part = id => document.getElementById(id);
const sides = ["left", "right"];
const films = sides.map(side => part(side + "-film"));
const answers = new Map();
let at = -1, since = 0, saved = false;

function show(id) {
  for (const name of ["intro", "question", "end"]) part(name).hidden = name !== id;
}
function play() {
  for (const film of films) { film.currentTime = 0; film.play().catch(() => {}); }
}
function mark() {
  const choice = at < data.items.length ? answers.get(data.items[at].id)?.choice : null;
  for (const side of sides) part(side).classList.toggle("chosen", choice === side);
}
function go(to) {
  at = to;
  if (at >= data.items.length) {
    films.forEach(film => film.pause());
    return show("end");
  }
  show("question");
  const item = data.items[at];
  films.forEach((film, k) => { film.src = "data:video/mp4;base64," + data.films[item[sides[k]]]; });
  part("done").style.width = 100 * at / data.items.length + "%";
  part("count").textContent = "Pair " + (at + 1) + " of " + data.items.length;
  part("back").disabled = at === 0;
  since = performance.now();
  mark();
  play();
}
function choose(side) {
  const item = data.items[at].id;
  const ms = Math.round(performance.now() - since);
  answers.set(item, { item: item, choice: side, ms: ms });
  mark();
  const here = at;
  setTimeout(() => { if (at === here) go(at + 1); }, 180);
}
function save() {
  const votes = { format: data.format, version: 1, study: data.study, page: data.page,
    answers: data.items.map(item => answers.get(item.id)) };
  const file = new Blob([JSON.stringify(votes)], { type: "application/json" });
  const link = document.createElement("a");
  link.href = URL.createObjectURL(file);
  link.download = "votes_" + data.page + ".json";
  link.click();
  saved = true;
}
sides.forEach((side, k) => {
  part(side + "-button").onclick = () => choose(side);
  films[k].onclick = () => choose(side);
  films[k].onended = play;
});
part("start").onclick = () => go(0);
part("again").onclick = play;
part("back").onclick = () => { if (at > 0) go(at - 1); };
part("review").onclick = () => go(data.items.length - 1);
part("save").onclick = save;
document.addEventListener("keydown", event => {
  if (event.repeat || event.ctrlKey || event.metaKey || event.altKey) return;
  if (at < 0 || at >= data.items.length) return;
  const keys = { ArrowLeft: () => choose("left"), "1": () => choose("left"),
    ArrowRight: () => choose("right"), "2": () => choose("right"),
    " ": play, Backspace: () => { if (at > 0) go(at - 1); } };
  if (event.key in keys) { event.preventDefault(); keys[event.key](); }
});
addEventListener("beforeunload", event => {
  if (answers.size && !saved) event.preventDefault();
});
"""
