# SPDX-License-Identifier: Apache-2.0
"""Loads the pages of the documentation site in headless Chromium. browser.py FOLDER checks an existing site.

The pages of the actions are made alike, so only the four longest of them are loaded. shader/look.py is for the page with particles.

In windows of the width of a phone and of a desktop, no page may be wider than the window, every picture must load, and
the console must show no error. Exits with 77 (skipped) if MkDocs, Chromium or Selenium is not installed.
"""

import shutil
import sys
import threading
import time
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import run

WIDTHS = {"phone": 390, "desktop": 1280}
LONGEST = 4  # of the pages of actions
OPTIONS = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu"]  # work for root, in a container
# The search indexes the whole site anew in a worker of each page. Only the page that searches needs it.
NO_WORKER = "if (!location.pathname.endsWith('/search.html')) window.Worker = class { postMessage() {} };"
# The errors of the loaded page. A block that scrolls by itself may contain wider elements.
ERRORS = """
const page = document.documentElement, width = page.clientWidth, wrong = [];
if (page.scrollWidth > width) wrong.push(`the page is ${page.scrollWidth} pixels wide, the window ${width}`);
const end = element => Math.floor(element.getBoundingClientRect().right);
const scrolls = element => element != document.body &&
    (["auto", "scroll"].includes(getComputedStyle(element).overflowX) || scrolls(element.parentElement));
for (const element of document.body.querySelectorAll("*"))
    if (end(element) > width && end(element.parentElement) <= width && !scrolls(element)) {
        const text = element.textContent.trim().replace(/\\s+/g, " ").slice(0, 60);
        wrong.push(`<${element.localName}> ends at ${end(element)} of ${width} pixels: ${text}`);
    }
for (const image of document.images)
    if (!image.complete || image.naturalWidth == 0) wrong.push(`${image.src} did not load`);
return wrong;
"""


class Files(SimpleHTTPRequestHandler):
    """Serves a folder without a log."""

    def log_message(self, *_):
        pass


def resize(browser, window):
    """Gives the window the width of a device."""
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                            {"width": WIDTHS[window], "height": 800, "deviceScaleFactor": 1, "mobile": window == "phone"})


def loaded(browser, address):
    """Loads a page in a phone's window, widens it, and returns the errors."""
    resize(browser, "phone")
    browser.get(address)
    wrong = [f"on a phone: {error}" for error in browser.execute_script(ERRORS)]
    resize(browser, "desktop")
    wrong += [f"on a desktop: {error}" for error in browser.execute_script(ERRORS)]
    return wrong + [line["message"] for line in browser.get_log("browser") if line["level"] == "SEVERE"]


def pages_of(folder):
    """Returns the paths of the pages to load."""
    pages = sorted(folder.rglob("*.html"))
    actions = sorted((page for page in pages if page.parent.name == "actions"), key=lambda page: page.stat().st_size)
    return [str(page.relative_to(folder)) for page in pages if page not in actions[:-LONGEST] and page.name != "look.html"]


def problems(folder, browser, address):
    """Returns the errors of the site, one per line, and the number of pages loaded."""
    pages, wrong = pages_of(folder), []
    browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": NO_WORKER})
    for page in pages:
        wrong += [f"{page}: {error}" for error in loaded(browser, f"{address}/{page}")]
    # The pages also open from the folder, without a server, and without the search.
    wrong += [f"index.html from the folder: {error}" for error in loaded(browser, (folder / "index.html").as_uri())]
    wrong += [f"the search: {error}" for error in loaded(browser, f"{address}/search.html?q=obstacle")]
    deadline = time.monotonic() + 20
    while not browser.execute_script("return document.querySelector('#mkdocs-search-results article')"):
        if time.monotonic() > deadline:
            wrong.append("the search does not find 'obstacle'")
            break
        time.sleep(0.1)
    return wrong, len(pages)


def check(folder):
    """Returns the argument of sys.exit(): 0, or the errors."""
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    for option in OPTIONS:
        options.add_argument(option)
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Files, directory=folder)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        browser = webdriver.Chrome(options=options, service=Service(DRIVER))
        try:
            wrong, pages = problems(folder, browser, f"http://127.0.0.1:{server.server_port}")
        finally:
            browser.quit()
            server.shutdown()
    print(f"site: {pages} pages in windows {' and '.join(map(str, WIDTHS.values()))} pixels wide")
    return "\n".join(wrong) or 0


CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
try:
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service
except ImportError:
    webdriver = None
if not (CHROMIUM and DRIVER and webdriver):
    print("skipped: there is no Chromium with Selenium here (apt-get install chromium-driver python3-selenium)")
    sys.exit(77)
sys.exit(run.main(check, *sys.argv[1:]))
