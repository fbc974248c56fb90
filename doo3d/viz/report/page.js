// the page except its plots: figures, failed frames, thumbnails
const data = JSON.parse(document.getElementById("data").textContent);
const frames = data.frames, succeeded = frames.filter((frame) => frame.error === null), failed = frames.filter((frame) => frame.error !== null);
const metric = !succeeded.some((frame) => frame.mode === "2d");
const by = (id) => document.getElementById(id);

function make(tag, text, parent, className) {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  if (className) element.className = className;
  if (parent) parent.append(element);
  return element;
}
const lengthText = (length) => metric ? `${length.toFixed(3)} m` : `${length.toFixed(0)} px`;
const radiusText = (radius) => radius === null ? "–" : metric ? `${(1000 * radius).toFixed(1)} mm` : `${radius.toFixed(1)} px`;
const percent = (share) => share > 0 && share < 0.01 ? "< 1 %" : `${Math.round(100 * share)} %`;
const timeText = (seconds) => seconds < 10 ? `${Math.round(1000 * seconds)} ms` : `${seconds.toFixed(1)} s`;
const counted = (count, noun) => `${count} ${noun}${count === 1 ? "" : "s"}`;
const chainsText = (frame) => (frame.objects ? `${counted(frame.objects.length, "object")}, ` : "") + counted(frame.chains.length, "chain")
  + (frame.junctions ? `, ${counted(frame.junctions.length, "junction")}` : "") + (frame.doubtful.length ? `, ${frame.doubtful.length} doubtful` : "");
const sum = (values) => values.reduce((total, value) => total + value, 0);
function median(values) {
  const sorted = [...values].sort((a, b) => a - b), middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}

/** Return the number of cables, which tracking tells from that of the chains in all frames, and of the frames with chains. */
function cableFigures(chains) {
  const ids = new Set(chains.map((chain) => chain.id)), tracked = chains.length > 0 && !ids.has(null);
  return [tracked ? [succeeded.some((frame) => frame.junctions?.length) ? "Different chains" : "Cables", ids.size] : ["Chains", chains.length], ["Frames with chains", `${succeeded.filter((frame) => frame.chains.length).length} of ${frames.length}`]];
}

function heading() {
  const name = data.input.split(/[\\/]/).filter(Boolean).pop() || data.results;
  by("title").textContent = name;
  by("about").textContent = `${data.input} (${data.format}), doo3d ${data.version}`;
  const chains = succeeded.flatMap((frame) => frame.chains), times = succeeded.map((frame) => frame.seconds).filter((each) => each !== null);
  const shares = succeeded.map((frame) => frame.occluded).filter((each) => each !== null);
  const figures = [["Frames", frames.length], ["Failed", failed.length, failed.length > 0], ...cableFigures(chains)];
  const unsure = chains.filter((chain) => chain.doubt).length, doubtful = sum(succeeded.map((frame) => frame.doubtful.length));
  if (unsure) figures.push(["Chains below 0.5", `${unsure} of ${chains.length}`, true]);
  if (doubtful) figures.push(["Doubtful, not in chains", doubtful, true]);
  const branched = succeeded.filter((frame) => frame.objects);
  if (branched.length) {
    figures.push(["Objects, median", median(branched.map((frame) => frame.objects.length))], ["Junctions, median", median(branched.map((frame) => frame.junctions.length))]);
  }
  if (chains.length) {
    figures.push(["Length, median", lengthText(median(chains.map((chain) => chain.length)))]);
    const radii = chains.map((chain) => chain.radius).filter((each) => each !== null);
    if (radii.length) figures.push(["Radius, median", radiusText(median(radii))]);
    figures.push(["Occluded, mean", percent(sum(shares) / shares.length)]);
  }
  if (times.length) figures.push(["Time, median", timeText(median(times))], ["Time, first frame", timeText(times[0])]);
  if (times.length > 1) figures.push(["Time, longest of the others", timeText(Math.max(...times.slice(1)))]);
  for (const [label, value, bad] of figures) {
    const box = make("div", undefined, by("figures"), bad ? "bad" : "");
    make("dt", label, box);
    make("dd", value, box);
  }
}

function doubts() {
  by("doubts").hidden = !data.notes.length;
  for (const note of data.notes) make("li", note, by("doubts").querySelector("ul"));
}

function failures() {
  by("failed").hidden = !failed.length;
  const body = by("failed").querySelector("tbody");
  for (const frame of failed) {
    const row = make("tr", undefined, body);
    make("td", frame.name, row);
    make("td", frame.error, row);
  }
}

const pictureOf = (frame) => `data:image/webp;base64,${frame.picture}`;
const thumbnailLoader = new IntersectionObserver((entries) => {
  for (const { isIntersecting, target } of entries) {
    if (!isIntersecting) continue;
    target.src = pictureOf(frames[target.dataset.frame]);
    thumbnailLoader.unobserve(target);
  }
}, { rootMargin: "400px" });

const opens = metric ? "Click a picture to see its chains in 3-D, from all sides." : "Click a picture to see its chains enlarged.";

function card(frame, number) {
  const item = make("li"), button = make("button", undefined, item, frame.error === null ? "" : "failed");
  button.type = "button";
  button.title = opens;
  button.addEventListener("click", () => open(number));
  if (frame.picture) {
    const image = make("img", undefined, button);
    image.alt = "";
    image.dataset.frame = number;
    thumbnailLoader.observe(image);
  } else {
    make("div", frame.error ?? (frame.file === null ? "no picture was drawn" : "the picture is missing"), button, "none");
  }
  make("span", frame.name, button);
  const summary = frame.error === null ? [chainsText(frame), ...frame.chains.slice(0, 2).map((chain) => lengthText(chain.length))] : ["failed"];
  if (frame.chains?.length > 2) summary.push("…");
  const unsure = frame.chains?.filter((chain) => chain.doubt).length;
  if (unsure) summary.push(`${unsure} below 0.5`);
  make("small", summary.join(", "), button);
  return item;
}

const ascending = (value) => value ?? Infinity, descending = (value) => -(value ?? -Infinity);
const orders = {
  "failed first, then in time": (frame) => frame.error === null ? 1 : 0,
  "least confident first": (frame) => ascending(frame.confidence),
  "most occluded first": (frame) => descending(frame.occluded),
  "most chains first": (frame) => descending(frame.chains?.length),
  "slowest first": (frame) => descending(frame.seconds),
};
let order = [];

function sortFrames() {
  const key = orders[by("order").value], sought = by("search").value.trim().toLowerCase();
  order = frames.map((_, number) => number).filter((number) => frames[number].name.toLowerCase().includes(sought));
  const keys = frames.map(key);
  order.sort((a, b) => keys[a] === keys[b] ? a - b : keys[a] < keys[b] ? -1 : 1);
  by("frames").replaceChildren(...order.map((number) => cards[number]));
  by("shown").textContent = sought ? `${order.length} of ${frames.length}` : "";
}

/** Load the scripts that draw plots, once: they are large, so the page is shown first. */
function loadPlots() {
  for (const id of ["plotly", "plots-script"]) {
    const source = by(id);
    if (!source) continue;
    source.remove();
    make("script", source.textContent, document.head);
  }
}
function open(number) {
  loadPlots();
  show(number);
}

heading();
doubts();
failures();
for (const name of Object.keys(orders)) make("option", name, by("order"));
by("opens").textContent = frames.length ? opens : "";
by("empty").hidden = frames.length > 0;
by("choice").hidden = frames.length < 2;
const cards = frames.map(card);
sortFrames();
by("order").addEventListener("change", sortFrames);
by("search").addEventListener("input", sortFrames);
by("choice").addEventListener("submit", (event) => event.preventDefault());
requestAnimationFrame(() => setTimeout(loadPlots));
