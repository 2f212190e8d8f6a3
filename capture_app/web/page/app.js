// The page of omocap: one document, a view for each address.
import { api, ApiError, connection } from "./core/api.js";
import { h, here, put } from "./core/dom.js";
import { poll } from "./core/poll.js";
import { Router } from "./core/router.js";
import { ended } from "./core/words.js";
import { login } from "./parts/login.js";
import { troublePage } from "./parts/trouble.js";
import { job } from "./views/job.js";
import { library } from "./views/library.js";
import { result } from "./views/result.js";
import { start } from "./views/start.js";
/** @import {Job} from "./core/answers.js"
 *  @import {ViewOf} from "./core/router.js" */

/** A view that is loaded when somebody goes there. @param {string} name @returns {ViewOf} */
const later = (name) => async (visit) => {
  const module = await import(`./views/${name}.js`).catch(async (error) => {
    // Where the server does not answer, that is what is said.
    await api("/api/health");
    throw error;
  });
  return module[name](visit);
};

/** An address that leads nowhere. @type {ViewOf} */
const missing = async () => {
  const error = new ApiError(404, { code: "page-missing", what: "There is no such page." });
  return { title: "Not here", node: troublePage(error) };
};

/** @type {[RegExp, ViewOf][]} */
const ROUTES = [
  [/^\/$/, start],
  [/^\/library$/, library],
  [/^\/sessions\/(?<id>[0-9a-f]{16})$/, later("session")],
  [/^\/objects\/(?<id>[0-9a-f]{16})$/, later("object")],
  [/^\/mounts\/(?<id>[0-9a-f]{16})$/, later("mount")],
  [/^\/calibrate$/, later("calibrate")],
  [/^\/scan$/, later("scan")],
  [/^\/jobs\/(?<id>[0-9a-f]{16})$/, job],
  [/^\/results\/(?<id>[0-9a-f]{16})$/, result],
  [/^\/compare$/, later("compare")],
  [/^/, missing],
];

const main = here("main");
const router = new Router(main, ROUTES, (error) =>
  error.status === 401 ? login(() => router.show({ again: true })) : troublePage(error),
);

/** The link of the place one is at is marked. @param {string} path */
function markNavigation(path) {
  for (const link of document.querySelectorAll("header nav a")) {
    if (link.getAttribute("href") === `#${path}`) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
}

function watchConnection() {
  const banner = here("banner");
  connection.addEventListener("lost", () =>
    put(banner, h("p", {}, "omocap does not answer. Is it still running? This page goes on as soon as it is back.")),
  );
  connection.addEventListener("back", () => {
    put(banner);
    if (router.view?.failed) router.show({ again: true });
  });
}

/** How many jobs are at work, in the header, in every tab. */
function watchJobs() {
  const place = here("running");
  const forever = new AbortController().signal;
  poll(
    async () => {
      /** @type {Job[]} */
      const jobs = await api("/api/jobs?limit=20").catch(() => []);
      const live = jobs.filter((one) => !ended(one));
      const words = live.length === 1 ? "1 job at work" : `${live.length} jobs at work`;
      const link = h("a", { class: "chip", href: live.length === 1 ? `#/jobs/${live[0].id}` : "#/library" }, words);
      if (place.textContent !== (live.length ? words : "")) put(place, live.length ? link : null);
    },
    3000,
    forever,
    () => {},
  );
}

here("skip").addEventListener("click", (event) => {
  event.preventDefault();
  main.focus();
});
// A file that misses the drop area must not replace the page.
for (const event of ["dragover", "drop"]) addEventListener(event, (given) => given.preventDefault());
document.addEventListener("shown", (event) => {
  if (event instanceof CustomEvent) markNavigation(event.detail.path);
});
watchConnection();
watchJobs();
router.show();
