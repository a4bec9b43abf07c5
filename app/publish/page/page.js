
"use strict";
(() => {
const $ = id => document.getElementById(id);
const show = (id, text) => { const e = $(id), t = String(text); if (e.textContent !== t) e.textContent = t; };
const number = (v, digits) => v === null || v === undefined ? "–" : Number(v).toFixed(digits);
const colour = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();

const STATES = {initialising: "starting", parallel_monocular: "uncalibrated, cameras tracked independently", calibrating: "calibrating",
                stereo_odometry: "stereo odometry", recalibrating: "recalibrating", lost: "lost"};
const token = () => location.hash.slice(1).replace(/[^\w-]/g, "");
const CAUSES = {given: "supplied", state_file: "from the last run", whole_drive: "from the whole sequence", knock: "recalibrated after a knock",
                collapse: "recalibrated after a hard knock", drift: "recalibrated after a drift"};
const drive = {trail: [], enu_alignment: null, now: null, can: {}, ended: false};
const BLANK = new Map(["status", "state", "why", "frame", "frames", "path", "from_ins", "ins_more", "inliers", "stereo", "ms", "ms_more",
                       "age", "image_frame"].map(id => [id, $(id).textContent]));
let picture = null, drawing = false;

// ---- figures

function tone(name) {
  $("band").classList.remove("tone-none", "tone-ok", "tone-degraded", "tone-lost");
  $("band").classList.add("tone-" + name);
}

function showStatus(now) {
  tone(now.status);
  show("status", now.status.toUpperCase());
  show("state", STATES[now.state] || now.state);
  const words = now.reason && now.reason !== "none" ? now.reason.replaceAll("_", " ") : "";
  show("why", words + (now.advice ? (words ? ": " : "") + now.advice : ""));
}

const lasting = s => s < 120 ? number(s, 0) + " s" : number(s / 60, 0) + " min";

function showSilence(now) {
  tone("none");
  show("status", "NO FRAMES");
  show("state", "for " + lasting(now.since_s));
  show("why", `the last one was ${now.status.toUpperCase()}; see the events`);
}

function showNow(now) {
  drive.now = now;
  if (now.silent && !drive.ended) showSilence(now); else showStatus(now);
  show("frame", now.frame);
  show("frames", drive.frames ? "of " + drive.frames : "at " + number(now.s, 1) + " s");
  show("path", number(now.path_m, 1));
  show("from_ins", now.ins ? number(now.ins.across_m, 2) : "–");
  show("ins_more", now.ins ? `m · up ${number(now.ins.up_m, 1)} · ${number(now.ins.heading_deg, 1)}°` : "not compared");
  show("inliers", now.inliers);
  show("stereo", `points, ${now.stereo_inliers} in both`);
  show("ms", number(now.estimate_ms, 1));
  show("ms_more", `ms · p50 ${number(now.estimate_p50_ms, 1)} · p99 ${number(now.estimate_p99_ms, 1)}`);
  show("age", number(now.age_ms, 1));
  rows($("times"), [
    ["frames read", now.read],
    ["ok / degraded / lost", `${now.ok} / ${now.degraded} / ${now.lost}`],
    ["missing frames", now.missing],
    ["stamp error, at most", number(now.stamp_error_us, 1) + " µs"],
    ["exposure spread", number(now.spread_us, 1) + " µs"],
    ["pairing", now.pairing],
    ["residual", number(now.reprojection_px, 2) + " px"],
    ["latitude", now.enu ? number(now.enu.latitude_deg, 6) + "°" : "not aligned yet"],
    ["longitude", now.enu ? number(now.enu.longitude_deg, 6) + "°" : "not aligned yet"],
    ["heading", now.enu ? number(now.enu.heading_deg, 1) + "°" : "not aligned yet"],
  ]);
}

function rows(table, list) {
  if (table.rows.length !== list.length) {
    table.replaceChildren(...list.map(() => {
      const tr = document.createElement("tr");
      tr.append(document.createElement("th"), ...list[0].slice(1).map(() => document.createElement("td")));
      return tr;
    }));
  }
  list.forEach((values, i) => values.forEach((value, k) => {
    const cell = table.rows[i].cells[k];
    if (cell.textContent !== String(value)) cell.textContent = value;
  }));
}

function item(text) {
  const li = document.createElement("li");
  li.textContent = text;
  return li;
}

// Numbers of events and calibrations that the page shows; the session files have all of them.
const EVENTS = 10, HISTORY = 4;

function showEvents(list) {
  const ul = $("events");
  for (const e of list) ul.prepend(item(`${number(e.s, 1)} s · ${e.kind.replaceAll("_", " ")} · ${e.message}`));
  while (ul.childElementCount > EVENTS) ul.lastChild.remove();
}

function showCalibration(c) {
  const words = c.cameras.length < 2 ? "none yet: drive past near objects"
    : `${CAUSES[c.cause] || "found: " + (c.cause || "").replaceAll("_", " ")}, ${c.verified ? "verified" : "not verified yet"}`;
  show("calibration_words", words + (c.depth ? ` · depth ±${number(2 * c.depth.sigma_percent, 1)} % at ${number(c.depth.at_m, 0)} m` : ""));
  const names = ["rotation x, °", "rotation y, °", "rotation z, °", "translation x, mm", "translation y, mm", "translation z, mm"];
  const parts = [];
  for (let k = 1; k < c.cameras.length; ++k) {
    const table = document.createElement("table");
    const text = ([value, sigma], i) => number(value, i < 3 ? 4 : 2) + (sigma === null ? "" : " ± " + number(sigma, i < 3 ? 4 : 2));
    const measured = c.measured ? c.measured[k].parameters : null;
    rows(table, [["", measured ? "in use" : "in use, ± 2 σ", ...(measured ? ["measured, ± 2 σ"] : [])],
      ...c.cameras[k].parameters.map((f, i) =>
        [(c.cameras.length > 2 ? `camera ${k}: ` : "") + names[i], text(f, i), ...(measured ? [text(measured[i], i)] : [])])]);
    parts.push(table);
  }
  const note = document.createElement("p");
  note.className = "soft";
  note.textContent = "σ includes uncertain intrinsics; a calibration supplied without σ has none until it is measured online.";
  $("calibration").replaceChildren(...parts, ...(parts.length ? [note] : []));
  $("history").replaceChildren(...c.history.slice(-HISTORY).reverse().map(h =>
    item(`${number(h.s, 1)} s · ${h.what} · ${h.cause.replaceAll("_", " ")}${h.reason ? " · " + h.reason : ""}`)));
}

// ---- map

const onEarth = p => {
  const m = drive.enu_alignment;
  return m ? [m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3], m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7]] : [p[0], p[2]];
};

function fit(canvas) {
  const ratio = window.devicePixelRatio || 1, width = Math.round(canvas.clientWidth * ratio);
  const height = Math.round(width * 0.75);
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
  return ratio;
}

function drawMap() {
  const canvas = $("map"), ratio = fit(canvas), g = canvas.getContext("2d");
  g.clearRect(0, 0, canvas.width, canvas.height);
  const ours = drive.trail.map(onEarth), theirs = drive.enu_alignment ? drive.trail.filter(p => p.length > 4).map(p => [p[4], p[5]]) : [];
  // After a long drive the trail's steps are long, so the newest position is added.
  if (drive.now && drive.now.position_m) ours.push(onEarth(drive.now.position_m));
  show("map_words", drive.enu_alignment ? "View from above, north up; the bar is the scale." : "View from above, the first viewing direction up; the bar is the scale. The INS appears after the ENU alignment.");
  if (!ours.length) return;
  let [l, b, r, t] = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x, y] of ours.concat(theirs)) { l = Math.min(l, x); r = Math.max(r, x); b = Math.min(b, y); t = Math.max(t, y); }
  const margin = 26 * ratio, least = 10;
  const scale = Math.min((canvas.width - 2 * margin) / Math.max(r - l, least), (canvas.height - 2 * margin) / Math.max(t - b, least));
  const at = ([x, y]) => [canvas.width / 2 + (x - (l + r) / 2) * scale, canvas.height / 2 - (y - (b + t) / 2) * scale];
  const line = (points, name, width, dash) => {
    g.beginPath();
    points.forEach((p, i) => { const [x, y] = at(p); if (i) g.lineTo(x, y); else g.moveTo(x, y); });
    g.strokeStyle = colour(name); g.lineWidth = width * ratio; g.setLineDash(dash.map(d => d * ratio)); g.lineJoin = "round"; g.stroke(); g.setLineDash([]);
  };
  line(theirs, "theirs", 4, [10, 6]);
  line(ours, "ours", 2.5, []);
  g.fillStyle = colour("care");
  drive.trail.forEach((p, i) => { if (p[3] > 0) { const [x, y] = at(ours[i]); g.fillRect(x - 2 * ratio, y - 2 * ratio, 4 * ratio, 4 * ratio); } });
  const [x, y] = at(ours[ours.length - 1]);
  g.beginPath(); g.arc(x, y, 7 * ratio, 0, 7); g.fillStyle = colour("ours"); g.fill();
  g.lineWidth = 2 * ratio; g.strokeStyle = colour("panel"); g.stroke();
  // a bar of a round length
  const wanted = canvas.width / 4 / scale, ten = 10 ** Math.floor(Math.log10(wanted)), bar = [5, 2, 1].map(k => k * ten).find(v => v <= wanted);
  g.fillStyle = g.strokeStyle = colour("ink"); g.lineWidth = 2 * ratio;
  g.beginPath(); g.moveTo(10 * ratio, canvas.height - 10 * ratio); g.lineTo(10 * ratio + bar * scale, canvas.height - 10 * ratio); g.stroke();
  g.font = `${13 * ratio}px system-ui,sans-serif`;
  g.fillText(bar + " m", 10 * ratio, canvas.height - 16 * ratio);
}

// ---- images

function decode(jpeg) {
  if (!jpeg) return Promise.resolve(null);
  const bytes = Uint8Array.from(atob(jpeg), c => c.charCodeAt(0));
  return createImageBitmap(new Blob([bytes], {type: "image/jpeg"}));
}

// Seen by both cameras: a disc; by one alone: a ring.
function mark(g, x, y, both, size) {
  g.lineWidth = size / 2;
  g.beginPath(); g.arc(x, y, size, 0, 7);
  if (both) { g.fillStyle = "#35d0ff"; g.fill(); } else { g.strokeStyle = "#d0d6dc"; g.stroke(); }
}

function drawImage(canvas, side) {
  const image = picture.images[side];
  const ratio = window.devicePixelRatio || 1, g = canvas.getContext("2d");
  const width = Math.round(canvas.clientWidth * ratio), height = image.width ? Math.round(width * image.height / image.width) : Math.round(width * 0.75);
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
  g.clearRect(0, 0, width, height);
  if (!image.bitmap) return;
  g.drawImage(image.bitmap, 0, 0, width, height);
  const scale = width / image.width, size = 2.6 * ratio;
  for (const p of picture.points) {
    const at = side ? p.right : p.left;
    if (at) mark(g, at[0] * scale, at[1] * scale, p.right, size);
  }
}

function redraw() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(() => {
    drawing = false;
    drawMap();
    if (picture) { drawImage($("left"), 0); drawImage($("right"), 1); }
  });
}
window.addEventListener("resize", redraw);
matchMedia("(prefers-color-scheme:dark)").addEventListener("change", redraw);

function clearImage() {
  if (picture) for (const i of picture.images) if (i.bitmap) i.bitmap.close();
  picture = null;
}

async function showImages(message) {
  const epoch = have.epoch;
  const bitmaps = await Promise.all(message.images.map(i => decode(i.jpeg)));
  if (epoch !== have.epoch) {  // of a program that has been started again since
    for (const bitmap of bitmaps) if (bitmap) bitmap.close();
    return;
  }
  clearImage();
  picture = {frame: message.frame, images: message.images.map((i, k) => ({width: i.width, height: i.height, bitmap: bitmaps[k]})),
             points: message.points.map(p => ({left: [p[0] / 10, p[1] / 10], right: p.length > 2 ? [p[2] / 10, p[3] / 10] : null}))};
  show("image_frame", "frame " + message.frame + " · " + picture.points.length + " points");
  redraw();
}

// ---- the program

// An old OK must not be read as current: without updates, banner and images are grey.
function link(words, bad, past) {
  $("band").classList.toggle("past", past);
  show("link", words);
  $("link").className = bad ? "off" : "soft";
}

// Clears all values of another drive: its OK would be read as this one's.
function blank() {
  tone("none");
  for (const [id, words] of BLANK) show(id, words);
  $("times").replaceChildren();
  for (const id of ["left", "right"]) $(id).getContext("2d").clearRect(0, 0, $(id).width, $(id).height);
  clearImage();
  drive.now = null;
}

function begin(message) {
  if (!message.now || message.session !== drive.session) blank();
  Object.assign(drive, {session: message.session, frames: message.frames, trail: [], enu_alignment: null});
  document.title = "vergence · " + message.session;
  for (const button of document.querySelectorAll("button")) button.disabled = !token()
    || (button.dataset.action === "recalibrate" && !message.can_recalibrate) || (button.dataset.action === "stop-recording" && !message.recording);
  show("action_words", token() ? "" : "actions need the token: open the link printed at the start");
  $("events").replaceChildren();
}

// What is new since `have`; all of it from a program that has been started again.
function receive(message) {
  if (message.epoch !== have.epoch) begin(message);
  have = {epoch: message.epoch, after: message.version, image: message.images ? message.images.frame : message.epoch === have.epoch ? have.image : ""};
  showEvents(message.events);
  if (message.images) showImages(message.images).catch(console.error);
  if (message.enu_alignment) drive.enu_alignment = message.enu_alignment;
  if (message.calibration) showCalibration(message.calibration);
  drive.trail.splice(message.trail_from, Infinity, ...message.trail);
  drive.ended = message.ended;
  if (message.now) showNow(message.now);
  const silent = drive.now && drive.now.silent;
  const words = drive.ended ? "the session has ended" : !drive.now ? "waiting for the first frame" : silent ? "no frames" : "live";
  link(words + " · " + drive.session, !drive.ended && silent, drive.ended || !drive.now || silent);
  ++window.updates;
  redraw();
}

// Times until the next request: usually, without a connection, and after a refusal.
const POLL_MS = 100, AGAIN_MS = 1000, REFUSED_MS = 2000;
const QUIET_MS = 3000, GIVEN_UP_MS = 15000;
let have = {epoch: "", after: 0, image: ""}, connected = false, heard = 0;

// Returns the time until the next request, ms.
async function ask() {
  const answer = await fetch("/state?" + new URLSearchParams(have), {headers: token() ? {"X-Vergence-Token": token()} : {}, signal: AbortSignal.timeout(GIVEN_UP_MS)});
  const text = await answer.text();
  heard = performance.now();
  connected = answer.status === 200;
  if (answer.status === 204) link("connected, waiting for the session to start", false, true);
  if (!answer.ok) {
    link(`refused (${answer.status}): ${text.trim()}${answer.status === 403 ? "; open the link printed at the start" : ""}`, true, true);
    return REFUSED_MS;
  }
  try {
    if (connected) receive(JSON.parse(text));
  } catch (error) {
    // An error of the page itself must not look like a lost connection.
    console.error(error);
  }
  return POLL_MS;
}

async function poll() {
  const wait = await ask().catch(() => {
    connected = false;
    link(drive.ended ? "the session has ended; waiting for the next one" : "no connection: retrying", !drive.ended, true);
    return AGAIN_MS;
  });
  setTimeout(poll, wait);
}

// A network that has gone, or a program that hangs, gives no answer.
setInterval(() => {
  const quiet = performance.now() - heard;
  if (connected && quiet > QUIET_MS) link(`no data for ${lasting(quiet / 1000)}: check the network`, true, true);
}, 500);

for (const button of document.querySelectorAll("button")) button.addEventListener("click", async () => {
  const answer = await fetch("/" + button.dataset.action, {method: "POST", headers: {"X-Vergence-Token": token()}}).catch(() => null);
  show("action_words", answer && answer.ok ? button.textContent + ": requested" : answer && answer.status === 403 ? "refused: the token belongs to another session" : "no response from the program");
});
window.updates = 0;
poll();
})();
