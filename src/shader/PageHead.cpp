// SPDX-License-Identifier: Apache-2.0
#include "PageText.h"

namespace curlew {

// $TITLE and $COMMAND are replaced.
constexpr std::string_view kPageHead = R"html(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">
<title>$TITLE</title>
<link rel="icon" href="data:,">
<style>
:root { color-scheme: dark; --ink: #e6ebf2; --soft: #93a0b4; --line: #2a3342; --panel: #10151eee; --accent: #62c6ff; }
* { box-sizing: border-box; }
html, body { margin: 0; height: 100%; overflow: hidden; background: #080b11; color: var(--ink);
  font: 14px/1.4 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; }
canvas { position: fixed; inset: 0; width: 100%; height: 100%; display: block; touch-action: none; cursor: grab; }
canvas:active { cursor: grabbing; }
header { position: fixed; top: 0; left: 0; right: 0; padding: max(14px, env(safe-area-inset-top)) 16px 0;
  pointer-events: none; text-shadow: 0 1px 6px #000; }
h1 { font-size: 15px; font-weight: 600; margin: 0; overflow: hidden; text-overflow: ellipsis; white-space: nowrap; }
#figures { color: var(--soft); font-size: 12px; font-variant-numeric: tabular-nums; }
#bar { position: fixed; left: 50%; transform: translateX(-50%); bottom: max(14px, env(safe-area-inset-bottom));
  width: min(780px, calc(100% - 24px)); display: flex; flex-wrap: wrap; align-items: center; gap: 8px 10px; padding: 10px 12px;
  background: var(--panel); border: 1px solid var(--line); border-radius: 12px; }
#scrub { display: flex; flex: 1 1 240px; align-items: center; gap: 10px; min-width: 0; }
#scrub input { flex: 1; min-width: 0; accent-color: var(--accent); height: 24px; margin: 0; }
#time { color: var(--soft); font-size: 12px; font-variant-numeric: tabular-nums; min-width: 8.5em; text-align: right; }
#choices { display: flex; flex-wrap: wrap; align-items: center; gap: 8px; }
button, select { font: inherit; font-size: 13px; height: 34px; color: var(--ink); background: #1a212d;
  border: 1px solid var(--line); border-radius: 8px; padding: 0 11px; cursor: pointer; }
button:hover, select:hover { border-color: #46546b; }
button:focus-visible, select:focus-visible, input:focus-visible { outline: 2px solid var(--accent); outline-offset: 1px; }
button[aria-pressed="false"] { color: var(--soft); background: transparent; }
#play { width: 40px; padding: 0; }
#play svg { width: 14px; height: 14px; fill: currentColor; vertical-align: -2px; }
#about { position: fixed; right: 12px; left: 12px; bottom: 140px; max-width: 640px; max-height: 50%; margin: 0 auto; overflow: auto;
  padding: 12px 16px; background: var(--panel); border: 1px solid var(--line); border-radius: 12px; }
#about[hidden], #message[hidden] { display: none; }
#about p { margin: 0 0 8px; color: var(--soft); }
pre { margin: 0; white-space: pre-wrap; overflow-wrap: anywhere; font: 12px/1.5 ui-monospace, Menlo, Consolas, monospace; }
#message { position: fixed; inset: 0; display: grid; place-items: center; padding: 24px; text-align: center; color: var(--soft);
  pointer-events: none; }
</style>
</head>
<body>
<canvas id="view" aria-label="The flow in 3D: drag to turn, pinch or scroll to zoom"></canvas>
<header><h1>$TITLE</h1><div id="figures"></div></header>
<div id="message" role="status">Preparing the flow …</div>
<section id="about" hidden>
<p>Particles move in this page by the flow's own formulas, each on its track. Made by Curlew with this command:</p>
<pre>$COMMAND</pre>
</section>
<div id="bar">
  <div id="scrub">
    <button id="play" aria-label="Pause"></button>
    <input id="loop" type="range" min="0" step="1" value="0" aria-label="Time in the loop">
    <span id="time"></span>
  </div>
  <div id="choices">
    <select id="colours" aria-label="Colours"><option value="0">Speed</option><option value="1">Label</option></select>
    <button id="lines" aria-pressed="true">Lines</button>
    <button id="wall" aria-pressed="true">Wall</button>
    <button id="more" aria-pressed="false" aria-controls="about">Command</button>
  </div>
</div>
)html";

} // namespace curlew
