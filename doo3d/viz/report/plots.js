"use strict";
// the plots over the frames, and the dialog of one frame
const dark = matchMedia("(prefers-color-scheme: dark)");
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const safe = (text) => String(text).replace(/[&<>"']/g, (letter) => `&#${letter.charCodeAt(0)};`);  // Plotly interprets tags in texts
const POINTS = { size: 1, opacity: 0.55 };  // small and half transparent, so that the chains show through
const NARROW_PX = 600;  // of a view whose legend would hide the chains if there are more than three
const MARK_SIZE = 5;  // of ends and junctions, about twice the width of a tube
const shaded = (color) => `rgb(${[1, 3, 5].map((i) => Math.round(parseInt(color.slice(i, i + 2), 16) * css("--shade"))).join(",")})`;
const settings = { displaylogo: false, responsive: true };
const buttons = (...names) => ({ ...settings, modeBarButtons: [["toImage", ...names]] });

const TRAIL_SECONDS = 1, FRAME_RATE = 30;  // the rate without timestamps

// the x axis is time if every frame has a timestamp, else the number of the frame
const timed = frames.length > 1 && frames.every((frame) => frame.time !== null);
const start = timed ? Math.min(...frames.map((frame) => frame.time)) : 0;
const xOf = (number) => timed ? frames[number].time - start : number;

function plotLayout(unit, percentages) {
  const axis = { gridcolor: css("--line"), linecolor: css("--line"), zeroline: false, automargin: true };
  return {
    margin: { l: 46, r: 10, t: 8, b: 34 }, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { color: css("--quiet"), size: 12, family: "system-ui, sans-serif" }, showlegend: false, hovermode: "closest",
    xaxis: { ...axis, title: { text: timed ? "s" : "frame", standoff: 4 }, ...(timed ? {} : { tickformat: "d", ...(frames.length < 8 ? { dtick: 1 } : {}) }), ...(frames.length < 2 ? { range: [-1, 1], dtick: 1 } : {}) },
    yaxis: { ...axis, rangemode: "tozero", ticksuffix: unit, ...(percentages ? { range: [-3, 103] } : {}) },
    shapes: failed.map((frame) => frames.indexOf(frame)).map((number) => (
      { type: "line", xref: "x", yref: "paper", x0: xOf(number), x1: xOf(number), y0: 0, y1: 1, line: { color: css("--bad"), width: 1, dash: "dot" } })),
  };
}

const failedNumbers = frames.flatMap((frame, number) => frame.error === null ? [] : [number]);

/** Return values with an empty one for each failed frame, where a line has a gap. */
const withGaps = (values) => values.length < 2 ? values : [...values, ...failedNumbers.map((number) => [number, null, ""])].sort((a, b) => a[0] - b[0]);

/** Return a trace of values over frames: [number of the frame, value, text, symbol]. */
function line(measured, name, color, lines = true) {
  const values = lines ? withGaps(measured) : measured;
  return {
    type: "scatter", mode: lines && values.length > 1 && values.length <= 300 ? "lines+markers" : "markers", name,
    x: values.map(([number]) => xOf(number)), y: values.map(([, value]) => value), customdata: values.map(([number]) => number),
    text: values.map(([number, , text]) => `${safe(frames[number].name)}<br>${safe(text)}`), hovertemplate: "%{text}<extra></extra>",
    marker: { color, size: values.length > 300 ? 3 : 6, symbol: values.map(([, , , symbol]) => symbol ?? "circle") }, line: { color, width: 1.5 }, connectgaps: false,
  };
}

function lengths() {
  const rows = new Map();
  frames.forEach((frame, number) => frame.chains?.forEach((chain) => {
    if (!rows.has(chain.color)) rows.set(chain.color, []);
    rows.get(chain.color).push([number, chain.length, `${lengthText(chain.length)}, radius ${radiusText(chain.radius)}`]);
  }));
  return [...rows].map(([color, values]) => line(values, "", shaded(color), false));
}

function times() {
  const slow = (frame) => Object.entries(frame.stages).filter(([, duration]) => duration > 0).sort((a, b) => b[1] - a[1]).slice(0, 4)
    .map(([stage, duration]) => `${stage} ${timeText(duration)}`).join(", ");
  return [line(frames.flatMap((frame, number) => frame.error !== null || frame.seconds === null ? [] : [
    [number, 1000 * Math.min(frame.seconds, number === 0 ? firstTop : Infinity), `${timeText(frame.seconds)}${slow(frame) ? `: ${slow(frame)}` : ""}`,
      number === 0 && frame.seconds > firstTop ? "triangle-up" : "circle"]]), "", css("--strong"))];
}

// the first frame also loads the method: it is drawn at the top of the plot if it took longer than all others
const laterTimes = frames.slice(1).filter((frame) => frame.error === null && frame.seconds !== null).map((frame) => frame.seconds);
const firstTop = laterTimes.length ? 1.1 * Math.max(...laterTimes) : Infinity;
const firstNote = frames.length && frames[0].error === null && frames[0].seconds > firstTop ? ` (first frame: ${timeText(frames[0].seconds)}, drawn at the top)` : "";

function shares() {
  const values = (key, label) => frames.flatMap((frame, number) => frame[key] === undefined || frame[key] === null ? [] : [
    [number, 100 * frame[key], `${percent(frame[key])} ${label}`]]);
  return [line(values("confidence", "confidence of the least certain chain"), "confidence", css("--strong")), line(values("occluded", "occluded"), "occluded", shaded("#ff8a00"))];
}

const plots = [
  [`Length of each chain, ${metric ? "m" : "px"}`, lengths, "", false],
  [`Time, ms${firstNote}`, times, "", false],
  ["Least confidence of a chain, doubtful ones included (blue) and occluded share (orange)", shares, " %", true],
].filter(([, values]) => values().some((trace) => trace.x.length));

function drawPlots() {
  by("plots").replaceChildren();
  for (const [title] of plots) {
    const figure = make("figure", undefined, by("plots"));
    make("figcaption", title, figure);
    make("div", undefined, figure, "plot");
  }
  plots.forEach(([title, values, unit, percentages], number) => {
    const plot = by("plots").querySelectorAll(".plot")[number];
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", `${title}, over ${frames.length} frames`);
    Plotly.newPlot(plot, values(), plotLayout(unit, percentages), { ...settings, displayModeBar: false });
    plot.on("plotly_click", (event) => show(event.points[0].customdata));
  });
}

const isJoined = (frame, number, side) => !!frame.junctions?.some((junction) => junction.ends.some(([chain, end]) => chain === number && end === side));
/** Return the joint of a chain beside which its number stands: the first, or the middle one if the first is at a junction. */
const labelJoint = (frame, number) => isJoined(frame, number, 0) ? frame.chains[number].occluded.length >> 1 : 0;

function chainTraces(frame, chain, number) {
  const at = labelJoint(frame, number);
  const columns = unpack(chain.joints), joints = Array.from(columns[0], (_, i) => columns.map((column) => column[i]));
  const radii = chain.radii ? unpack(chain.radii)[0] : new Float64Array(joints.length).fill((chain.radius ?? 0));
  const deviations = chain.deviations && unpack(chain.deviations);
  const traces = [], color = shaded(chain.color), width = chain.width ?? 1, name = chainName(chain, number);
  kindRuns(kindsOf(chain)).forEach(([first, last, kind], piece) => {
    const mesh = tube(joints, radii.map((radius) => width * radius), first, last), part = (column) => Array.from(column.slice(first, last + 1));
    const text = mesh.joint.map((n) => `${name}, joint ${n}<br>radius ${radiusText(radii[n])}${deviations ? `<br>± ${radiusText(deviations[0][n])} across, ${radiusText(deviations[1][n])} along the ray` : ""}${kinds[kind].text}`);
    const { joint, ...shape } = mesh;
    const shared = { name, legendgroup: name, showlegend: false };
    traces.push({ ...shared, type: "mesh3d", ...shape, color, opacity: kinds[kind].opacity, hoverinfo: "text", hovertext: text,
      lighting: { ambient: 0.72, diffuse: 0.5, specular: 0.12 }, lightposition: { x: -2000, y: -10000, z: -10000 } });
    traces.push({ ...shared, type: "scatter3d", mode: "lines", x: part(columns[0]), y: part(columns[1]), z: part(columns[2]), hoverinfo: "skip",
      line: { color, width: 4 * width, dash: kinds[kind].dash }, showlegend: piece === 0 });
  });
  const sides = (chain.closed ? [0] : [0, 1]).filter((side) => !isJoined(frame, number, side)), ends = sides.map((side) => side * (joints.length - 1));
  traces.push({ type: "scatter3d", mode: "markers", name, legendgroup: name, showlegend: false, hoverinfo: "text",
    x: ends.map((n) => joints[n][0]), y: ends.map((n) => joints[n][1]), z: ends.map((n) => joints[n][2]), hovertext: sides.map((side) => `${name}, ${["first", "last"][side]} joint`),
    marker: { size: MARK_SIZE * width, color, symbol: sides.map((side) => ["circle", "circle-open"][side]), line: { color: css("--text"), width: 1 } } });
  traces.push({ type: "scatter3d", mode: "text", legendgroup: name, showlegend: false, hoverinfo: "skip", text: [chainLabel(chain, number)],
    x: [joints[at][0]], y: [joints[at][1]], z: [joints[at][2]], textposition: "top center", textfont: { size: 14, color: css("--text") } });
  return traces;
}

const DOUBTFUL = -1;  // in place of the number of a chain: it is one of the doubtful ones, not of the chains
const chainLabel = (chain, number) => number === DOUBTFUL ? "" : String(chain.id ?? number);
const chainName = (chain, number) => [...(number === DOUBTFUL ? [] : [`chain ${chain.id ?? number}`]), ...(chain.doubt ? [chain.doubt] : [])].join(", ");
const allChains = (frame) => [...frame.chains.map((chain, number) => [chain, number]), ...frame.doubtful.map((chain) => [chain, DOUBTFUL])];

/** Draw where both ends and the middle of a tracked chain were in the last second, as thin lines. */
function trailTraces(frame, chain) {
  if (chain.id === null || chain.closed) return [];
  const count = chain.occluded.length, now = frames.indexOf(frame), timeOf = (number) => timed ? frames[number].time : number / FRAME_RATE, past = [];
  for (let number = now; number >= 0 && timeOf(now) - timeOf(number) <= TRAIL_SECONDS; number--) {
    const other = frames[number].chains?.find((each) => each.id === chain.id && each.occluded.length === count);
    if (!other || frames[number].coordinates !== frame.coordinates) break;
    past.push(unpack(other.joints));
  }
  if (past.length < 2) return [];
  return [0, count >> 1, count].map((joint) => ({ type: "scatter3d", mode: "lines", name: "trail", legendgroup: `chain ${chain.id}`, showlegend: false, hoverinfo: "skip",
    ...Object.fromEntries(["x", "y", "z"].map((axis, k) => [axis, past.map((columns) => columns[k][joint])])), line: { color: shaded(chain.color), width: 1.5 } }));
}

/** Return the positions of the junctions of a frame as a trace of white diamonds, with `axes` such as "xyz". */
function junctionTraces(frame, axes, type) {
  if (!frame.junctions?.length) return [];
  const numberOf = (number) => frame.chains[number].id ?? number;
  return [{ type, mode: "markers", name: "junctions", showlegend: true, hoverinfo: "text",
    hovertext: frame.junctions.map((junction, number) => `junction ${number} of chains ${junction.ends.map(([chain]) => numberOf(chain)).join(", ")}<br>confidence ${percent(junction.confidence)}`),
    ...Object.fromEntries([...axes].map((axis, k) => [axis, frame.junctions.map((junction) => junction.position[k])])),
    marker: { size: axes.length === 3 ? MARK_SIZE : 9, color: "#ffffff", symbol: "diamond", line: { color: "#202020", width: 2 } } }];
}

function cloudTraces(cloud) {
  const columns = unpack(cloud), shades = colors(cloud.rgb), count = shades.length;
  return [["object's points", 0, cloud.on_object], ["surroundings", cloud.on_object, count]].filter(([, from, to]) => to > from).map(([name, from, to]) => ({
    type: "scatter3d", mode: "markers", name, hoverinfo: "skip", x: Array.from(columns[0].slice(from, to)),
    y: Array.from(columns[1].slice(from, to)), z: Array.from(columns[2].slice(from, to)),
    // points of the object are gray, to be told from its chain, whatever the color of both
    marker: { ...POINTS, color: cloud.has_color && from > 0 ? shades.slice(from, to) : css("--quiet"), line: { width: 0 } } }));
}

/** Return the sides of the bounding box of all traces; the longest is 1. */
function boxSides(traces) {
  const sides = ["x", "y", "z"].map((key) => {
    const values = traces.flatMap((trace) => Array.from(trace[key]));
    return values.reduce((a, b) => Math.max(a, b), -Infinity) - values.reduce((a, b) => Math.min(a, b), Infinity);
  });
  const longest = Math.max(...sides) || 1;
  return Object.fromEntries(["x", "y", "z"].map((key, k) => [key, Math.max(sides[k] / longest, 1e-3)]));
}

function drawSpace(frame) {
  const axis = { color: css("--quiet"), gridcolor: css("--line"), zerolinecolor: css("--line"), showbackground: false, showspikes: false };
  const optical = frame.coordinates === "camera";  // y down and z forward: viewed from slightly above the camera
  const camera = optical ? { up: { x: 0, y: -1, z: 0 }, eye: { x: 0.25, y: -0.45, z: -1.25 } } : { eye: { x: 0.85, y: 0.85, z: 0.7 } };
  const viewpoint = frame.cloud?.viewpoint;
  if (!optical && viewpoint) {
    const direction = unit(add(viewpoint, frame.cloud.center, -1));
    camera.eye = Object.fromEntries(["x", "y", "z"].map((key, k) => [key, 1.35 * direction[k]]));
    if (Math.abs(direction[2]) > 0.7) camera.up = { x: 0, y: -1, z: 0 };
  }
  const box = by("view"), tall = Math.min(Math.max(box.clientHeight / box.clientWidth, 1), 1.6);  // a narrow view shows less from the same distance
  camera.eye = Object.fromEntries(Object.entries(camera.eye).map(([key, value]) => [key, tall * value]));
  const traces = [...(frame.cloud ? cloudTraces(frame.cloud) : []), ...allChains(frame).flatMap(([chain, number]) => chainTraces(frame, chain, number)), ...frame.chains.flatMap((chain) => trailTraces(frame, chain)), ...junctionTraces(frame, "xyz", "scatter3d")];
  const sides = boxSides(traces), axisOf = (letter) => ({ ...axis, title: { text: `${letter} (m)` }, nticks: 2 + Math.round(5 * sides[letter]) });
  return Plotly.react(by("view"), traces, {
    margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", font: { color: css("--text"), family: "system-ui, sans-serif" }, uirevision: "same",
    legend: { x: 0.01, y: 0.99, bgcolor: css("--veil"), itemsizing: "constant" }, showlegend: allChains(frame).length <= (box.clientWidth < NARROW_PX ? 3 : 12),
    modebar: { bgcolor: "rgba(0,0,0,0)", color: css("--quiet"), activecolor: css("--strong") },
    scene: { aspectmode: "manual", aspectratio: sides, dragmode: "orbit", camera, xaxis: axisOf("x"), yaxis: axisOf("y"), zaxis: axisOf("z") },
  }, buttons("resetCameraDefault3d"));
}

function drawImage(frame) {
  const inImage = (chain) => kindsOf(chain).map((kind) => kind === 1 ? 0 : kind);
  const traces = allChains(frame).flatMap(([chain, number]) => kindRuns(inImage(chain)).map(([first, last, kind]) => {
    const [x, y] = unpack(chain.joints).map((column) => Array.from(column.slice(first, last + 1)));
    return { type: "scatter", mode: "lines+markers", x, y, name: chainName(chain, number), marker: { size: 4 * (chain.width ?? 1), color: chain.color },
      line: { color: chain.color, width: 3 * (chain.width ?? 1), dash: ["solid", "solid", "dot", "dashdot"][kind] }, showlegend: false };
  }));
  traces.push(...junctionTraces(frame, "xy", "scatter").map((trace) => ({ ...trace, showlegend: false })));
  const { width, height } = frame, size = frame.picture ? { x: [0, width], y: [height, 0] } : null;
  const axis = { color: css("--quiet"), showgrid: false, zeroline: false };
  return Plotly.react(by("view"), traces, {
    margin: { l: 44, r: 10, t: 10, b: 34 }, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", hovermode: "closest", dragmode: "pan",
    modebar: { bgcolor: "rgba(0,0,0,0)", color: css("--quiet"), activecolor: css("--strong") },
    xaxis: { ...axis, ...(size ? { range: size.x } : {}) },
    yaxis: { ...axis, scaleanchor: "x", ...(size ? { range: size.y } : { autorange: "reversed" }) },
    images: size ? [{ source: pictureOf(frame), xref: "x", yref: "y", x: 0, y: 0, sizex: width, sizey: height, sizing: "stretch", layer: "below" }] : [],
  }, { ...buttons("zoomIn2d", "zoomOut2d", "resetScale2d"), scrollZoom: true });
}

/** Return the columns of the table of a frame, [title, text of a chain]; those without anything to say are left out. */
function chainColumns(frame) {
  const share = (marks) => [...marks].filter((each) => each === "1").length / marks.length, chains = [...frame.chains, ...frame.doubtful], has = (key) => chains.some((chain) => chain[key]?.includes("1"));
  return [
    ["Confidence", (chain) => chain.doubt ? `${(Math.floor(100 * chain.confidence) / 100).toFixed(2)}, doubtful` : chain.confidence.toFixed(2)],
    ["Length", (chain) => lengthText(chain.length)],
    ["Radius", (chain) => radiusText(chain.radius)],
    ...(frame.objects ? [["Object", (_, number) => number === DOUBTFUL ? "–" : String(frame.objects.findIndex((members) => members.includes(number)))]] : []),
    ...(chains.some((chain) => chain.deviations) ? [["± across, along", (chain) => chain.deviations ? unpack(chain.deviations).map((column) => radiusText(median(Array.from(column)))).join(", ") : "–"]] : []),
    ["Occluded", (chain) => percent(share(chain.occluded))],
    ...(has("from_time") ? [["From other frames", (chain) => percent(share(chain.from_time ?? "0"))]] : []),
    ...(has("filled") && frame.mode === "3d" ? [["Depth filled", (chain) => percent(share(chain.filled))]] : []),
  ];
}

function chainTable(frame) {
  by("chains").replaceChildren();
  if (frame.error !== null || !allChains(frame).length) return;
  const head = make("tr", undefined, make("thead", undefined, by("chains"))), body = make("tbody", undefined, by("chains")), columns = chainColumns(frame);
  for (const title of ["Chain", ...columns.map(([title]) => title)]) make("th", title, head).scope = "col";
  for (const [chain, number] of allChains(frame)) {
    const row = make("tr", undefined, body, chain.doubt ? "doubtful" : ""), first = make("td", undefined, row);
    make("span", undefined, first, "dot").style.background = chain.color;
    first.append(`${chainLabel(chain, number) || "–"}${chain.closed ? ", a ring" : ""}`);
    for (const [, text] of columns) make("td", text(chain, number), row);
  }
}

let current = null, shownMode = null;

function show(number) {
  const frame = frames[number], at = order.indexOf(number);
  current = number;
  by("one-title").textContent = frame.name;
  by("one-notes").textContent = frame.error ?? [...(frame.objects_text ? [`${frame.objects_text}.`] : []), ...frame.notes].join(" ");
  by("one-notes").classList.toggle("bad", frame.error !== null);
  by("previous").disabled = at <= 0;
  by("next").disabled = at < 0 || at >= order.length - 1;
  by("full").hidden = !frame.picture;
  by("undrawn").hidden = frame.file !== null;
  by("full").removeAttribute("href");
  if (frame.picture) {
    by("picture").src = pictureOf(frame);
    by("picture").alt = `The picture of ${frame.name}: ${chainsText(frame)} over the image`;
    if (data.pictures !== null) by("full").href = `${data.pictures}${encodeURIComponent(frame.file)}`;
  }
  chainTable(frame);
  if (!by("one").open) by("one").showModal();
  const mode = frame.error !== null ? null : frame.mode;
  if (mode !== shownMode) Plotly.purge(by("view"));
  shownMode = mode;
  by("view").setAttribute("aria-label", frame.error !== null ? "" : `${chainsText(frame)} in ${frame.mode === "2d" ? "the image" : "space"}`);
  by("hint").textContent = mode !== "3d" ? "" : "Drag to rotate, scroll to zoom, right button to pan. "
    + (frame.cloud ? `${frame.cloud.on_object} points of the object and ${bytes(frame.cloud.rgb).length / 2 - frame.cloud.on_object} around it are shown.` : data.clouds_warning);
  if (mode) (mode === "2d" ? drawImage : drawSpace)(frame);
}

function step(by_) {
  const next = order[order.indexOf(current) + by_];
  if (next !== undefined) show(next);
}

by("previous").addEventListener("click", () => step(-1));
by("next").addEventListener("click", () => step(1));
by("close").addEventListener("click", () => by("one").close());
by("one").addEventListener("close", () => { Plotly.purge(by("view")); shownMode = null; });
by("one").addEventListener("click", (event) => { if (event.target === by("one")) by("one").close(); });
by("one").addEventListener("keydown", (event) => {
  if (event.key === "ArrowLeft") step(-1);
  if (event.key === "ArrowRight") step(1);
});
dark.addEventListener("change", () => { drawPlots(); if (by("one").open) show(current); });
drawPlots();
