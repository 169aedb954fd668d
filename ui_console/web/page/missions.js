// The missions of one server: each has a page of its own, which cannot reach another's robots.

import { find, make } from "./dom.js";

/** @import { Welcomed } from "./messages.d.ts" */

/** Text after "Stop scout1" for screen readers if there are several missions; red buttons show it by their style. */
export function ofMission() {
  const { mission } = document.body.dataset;
  return mission ? ` of ${mission}` : "";
}

/**
 * The missions with the addresses of their pages, as seen from any of these pages. Pure.
 *
 * @param {string[]} missions
 */
export function linksTo(missions) {
  return missions.map((name) => ({ name, href: `../${name}/` }));
}

/**
 * If the server has several missions, show the mission of this page, and links to the others.
 *
 * @param {Welcomed} welcome
 */
export function showMissions({ mission, missions }) {
  const nav = find("missions");
  nav.hidden = missions.length < 2;
  if (nav.hidden) return;
  document.body.dataset.mission = mission;
  document.body.style.setProperty("--mission", JSON.stringify(` · ${mission}`));
  const links = linksTo(missions).map(({ name, href }) => {
    const link = make("a", "", name);
    link.href = href;
    if (name === mission) link.setAttribute("aria-current", "page");
    return link;
  });
  nav.replaceChildren("Missions ", ...links);
}
