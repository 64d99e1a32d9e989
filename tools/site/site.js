// SPDX-License-Identifier: Apache-2.0
// Browsers do not start the search's worker for pages that are opened from a folder: hide the search there.
if (location.protocol === "file:") {
    window.Worker = class { postMessage() {} };
    for (const search of document.querySelectorAll("[role=search]")) search.hidden = true;
}
