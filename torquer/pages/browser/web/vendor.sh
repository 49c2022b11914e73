#!/usr/bin/env bash
# Makes the folders vendor/ of the pages from packages of the npm registry; see VENDORED.md.
# Needs npm, openssl and gzip.
# Packages are fixed by version and by the SHA-512 of the registry; compressed files bear no time.
set -euo pipefail
cd "$(dirname "$0")"

OPENMCT=openmct@4.2.0
OPENMCT_SHA512=3fprUHT5s22kBukpHC0WTWeW12UnD+JgehJN9KqjJoBbj928LV4um9FjHSRZG+P+6rAKZZD9+DFumVbDzJ4lHg==
THREE=three@0.187.0
THREE_SHA512=Qiu7R+Cmh8CstZsY1uJOSWnVlfo7ZtNLV7mF8Jltk3LB3AtDu9cRZlcnRKkAk8Y4z6KKw35z7Y7Urd7jWY8etA==
UPLOT=uplot@1.6.32
UPLOT_SHA512=KIMVnG68zvu5XXUbC4LQEPnhwOxBuLyW1AHtpm6IKTXImkbLgkMy+jabjLgSLMasNuGGzQm/ep3tOkyTxpiQIw==
ESBUILD=esbuild@0.28.2

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Unpacks the package $1 with the SHA-512 $2 into the folder $3.
unpack() {
  local archive
  archive=$work/$(npm pack "$1" --silent --pack-destination "$work")
  local found
  found=$(openssl dgst -sha512 -binary "$archive" | openssl base64 -A)
  [ "$found" = "$2" ] || { echo "$1: SHA-512 is $found, expected $2" >&2; exit 1; }
  mkdir -p "$3"
  tar -xzf "$archive" -C "$3" --strip-components=1
}

# Compresses the file $1 to $2.gz, without the comment in its last line that points to a source map.
compress() {
  sed -E '$ s,^(//|/\*)# sourceMappingURL=.*$,,' "$1" | gzip -9n >"$2.gz"
}

openmct() {
  local from=$work/openmct to=../../ground/web/vendor/openmct
  unpack "$OPENMCT" "$OPENMCT_SHA512" "$from"
  rm -rf "$to"
  mkdir -p "$to/fonts" "$to/images"
  for name in openmct.js inMemorySearchWorker.js espressoTheme.css; do
    compress "$from/dist/$name" "$to/$name"
  done
  cp "$from"/dist/fonts/*.woff "$to/fonts/"
  cp "$from"/dist/images/logo-openmct*.svg "$from"/dist/images/logo-nasa.svg "$to/images/"
  cp "$from/dist/favicons/favicon-32x32.png" "$to/"
  cp "$from/LICENSE.md" "$from/dist/openmct.js.LICENSE.txt" "$to/"
  cp "$from/src/plugins/licenses/third-party-licenses.json" "$to/"
}

three() {
  local build=$work/build to=vendor/three
  unpack "$THREE" "$THREE_SHA512" "$build/node_modules/three"
  npm install --silent --no-save --prefix "$work/tools" "$ESBUILD"
  rm -rf "$to"
  mkdir -p "$to"
  cp three_entry.js "$build/"
  (cd "$build" && "$work/tools/node_modules/.bin/esbuild" three_entry.js \
    --bundle --minify --format=esm --legal-comments=none --outfile=three.min.js --log-level=warning)
  compress "$build/three.min.js" "$to/three.min.js"
  cp "$build/node_modules/three/LICENSE" "$to/"
}

uplot() {
  local from=$work/uplot to=../../board/web/vendor/uplot
  unpack "$UPLOT" "$UPLOT_SHA512" "$from"
  rm -rf "$to"
  mkdir -p "$to"
  compress "$from/dist/uPlot.iife.min.js" "$to/uPlot.iife.min.js"
  compress "$from/dist/uPlot.min.css" "$to/uPlot.min.css"
  cp "$from/LICENSE" "$to/"
}

openmct
three
uplot
