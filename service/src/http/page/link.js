// What a page hears while somebody looks at it.
"use strict";

import { Feed } from "/feed.js";

// Tells `hear(kind, data)` of each message, and `looked()` when somebody begins to look.
export function listen(hear, looked) {
  let follow = shared(hear, () => {
    follow = alone(hear);
    changed();
  });
  const changed = () => {
    if (!document.hidden) looked();
    follow(!document.hidden);
  };
  document.addEventListener("visibilitychange", changed);
  window.addEventListener("pagehide", () => follow(false));
  window.addEventListener("pageshow", (event) => { if (event.persisted) changed(); });
  changed();
}

// Not every browser has a worker that its pages share.
function shared(hear, refused) {
  if (!window.SharedWorker) return alone(hear);
  const worker = new SharedWorker("/stream.js", { type: "module", name: "truestage" });
  worker.onerror = refused;
  worker.port.onmessage = ({ data: [kind, data] }) => hear(kind, data);
  return (isLooked) => worker.port.postMessage(isLooked);
}

function alone(hear) {
  const feed = new Feed(hear);
  return (isLooked) => (isLooked ? feed.begin() : feed.end());
}
