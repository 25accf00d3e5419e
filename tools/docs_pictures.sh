#!/bin/sh
# docs_pictures.sh PROGRAM [DEVICES]: makes pictures of the documents anew, in docs/images. Not those of windows and pages
# (live_view, live_cameras, web, web-past), nor the first scene's, which are scaled; Fig 14 and the dino need data.
set -eu
program=$1 devices=${2:-auto}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# sheet SCENE PICTURE MOMENTS: frames of a scene; without moments, twelve
sheet() {
  echo "docs/images/$2.png"
  "$program" run "$1" --devices "$devices" --out "$folder" --quiet ${3:+--moments "$3"} > "$folder/log" || {
    cat "$folder/log"
    exit 1
  }
  mv "$folder/$(basename "$1" .yaml).png" "docs/images/$2.png"
}

sheet docs/pictures/node_plane.yaml cut-node-plane 7,12,18
sheet docs/pictures/spanning.yaml cut-straight 7,12,18
sheet docs/pictures/strokes.yaml cut-strokes 0,9,12
sheet docs/pictures/pinch.yaml pinch 0,15,45,75,90,119
sheet scenes/stack.yaml stack 40,52,64
sheet scenes/demo.yaml demo 56
sheet scenes/liver-pool.yaml liver-pool
for figure in 15 16 17 18 19; do
  echo "docs/images/fig$figure.png"
  "$program" paper "fig$figure" --devices "$devices" --out "docs/images/fig$figure.png"
done
"$program" run scenes/cross.yaml --devices "$devices" --out "$folder" --quiet > "$folder/log"
mv "$folder"/cross-*-score.png docs/images/cross-score.png
