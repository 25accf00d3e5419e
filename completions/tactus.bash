# bash completion for tactus. Verbs and flags are asked of the program itself; tests hold the rest against it.
_tactus() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} program=${COMP_WORDS[0]} verb=${COMP_WORDS[1]}
  case $prev in
    --source) COMPREPLY=($(compgen -W "synthetic videos masks middlebury kinect recording live" -- "$cur")); return ;;
    --devices) COMPREPLY=($(compgen -W "auto cpu cpu:2 cuda:0 cuda:all" -- "$cur")); return ;;
    --view) COMPREPLY=($(compgen -W "file none" -- "$cur")); return ;;
    --json|--mesh|--out|--texture-views|--checkpoint|--restart|--record|--key) COMPREPLY=($(compgen -f -- "$cur")); return ;;
  esac
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "$(_tactus_verbs "$program") $(_tactus_flags "$program")" -- "$cur"))
    return
  fi
  if [[ $cur == -* ]]; then
    COMPREPLY=($(compgen -W "$(_tactus_flags "$program" "$verb")" -- "$cur"))
    return
  fi
  case $verb in
    run) COMPREPLY=($(compgen -f -X '!*.yaml' -- "$cur") $(compgen -d -- "$cur") $(_tactus_scenes "$program" "$cur")) ;;
    reconstruct|synth) COMPREPLY=($(compgen -W "$_tactus_figures" -- "$cur") $(compgen -f -- "$cur")) ;;
    noise) COMPREPLY=($(compgen -W "$_tactus_figures" -- "$cur")) ;;
    bench) COMPREPLY=($(compgen -W "all affine hull table2 table3 table4 table5 tissue fig20 fluid cut frame texture blade wire" -- "$cur")) ;;
    paper) COMPREPLY=($(compgen -W "fig14 fig15 fig16 fig17 fig18 fig19 fig20" -- "$cur")) ;;
    *) COMPREPLY=($(compgen -f -- "$cur")) ;;
  esac
}
_tactus_figures="hand rabbit scalpel sphere bowl liver"
# Scenes of the source tree and of the installation, wherever one stands.
_tactus_scenes() {
  local bin folder
  bin=$(dirname "$(command -v "$1")") 2>/dev/null
  for folder in scenes "$bin/../scenes" "$bin/../share/tactus/scenes"; do
    compgen -f -X '!*.yaml' -- "$folder/${2##*/}"
  done 2>/dev/null | grep -F -- "$2"
}
_tactus_verbs() {
  "$1" --help 2>/dev/null | sed -n '/^Subcommands:/,/^$/ s/^  \([a-z][a-z]*\).*/\1/p'
}
_tactus_flags() {
  "$@" --help 2>/dev/null | sed -n 's/^  \(-h,\)\{0,1\}\(--[a-z-]*\).*/\2/p'
}
complete -o filenames -F _tactus tactus
