// One stream of events for all pages of a browser: it opens six connections to one place, and STOP needs one of them.
"use strict";

import { EVENTS_SHOWN, Feed } from "/feed.js";

const pages = new Set();
let recent = [];
let isOpen = false;

const feed = new Feed((kind, data) => {
  if (kind === "open" || kind === "lost") isOpen = kind === "open";
  else if (kind !== "sample" && kind !== "alive") recent = [...recent, data].slice(-EVENTS_SHOWN);
  for (const page of pages) page.postMessage([kind, data]);
});

// A page that is looked at listens; one that is hidden holds no connection.
function look(page, isLooked) {
  if (!isLooked) {
    pages.delete(page);
  } else if (!pages.has(page)) {
    pages.add(page);
    recent.forEach((data) => page.postMessage(["past", data]));
    if (isOpen) page.postMessage(["open"]);
    feed.begin();
  }
  if (pages.size > 0) return;
  feed.end();
  [recent, isOpen] = [[], false];
}

self.onconnect = ({ ports: [page] }) => {
  page.onmessage = ({ data }) => look(page, data);
};
