# What tests of the live view's page share: source it after harness.sh.

# require_page: skips the test where the page, Chromium or what drives it is absent. Sets CHROMIUM.
require_page() {
  [[ -e $SKEIN_BUILD/web/index.html ]] || skip "the page is not built (scripts/setup.sh gets node and the packages)"
  CHROMIUM=$(command -v chromium || command -v chromium-browser || command -v google-chrome) ||
    skip "no Chromium (scripts/setup.sh --tests installs it)"
  [[ -e ${SKEIN_WEB_MODULES:-}/playwright-core/package.json ]] || skip "no playwright-core (scripts/setup.sh --tests gets it)"
  [[ -n ${IN_NAMESPACE:-} ]] || skip "no network namespace may be made here"
  export CHROMIUM SKEIN_WEB_MODULES
}
