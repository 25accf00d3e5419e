# bash completion for tactus
_tactus() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} verb=${COMP_WORDS[1]}
  case $prev in
    --source) COMPREPLY=($(compgen -W "middlebury videos masks synthetic" -- "$cur")); return ;;
    --devices) COMPREPLY=($(compgen -W "auto cpu cpu:2 cuda:0 cuda:all" -- "$cur")); return ;;
    --view) COMPREPLY=($(compgen -W "file none" -- "$cur")); return ;;
    --json|--mesh|--out|--texture-views) COMPREPLY=($(compgen -f -- "$cur")); return ;;
  esac
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "run reconstruct synth bench info --help --version" -- "$cur"))
    return
  fi
  case $verb in
    run) COMPREPLY=($(compgen -W "--devices --frames --out --json --view --verbose --quiet --help" -- "$cur") $(compgen -f -X '!*.yaml' -- "$cur")) ;;
    reconstruct) COMPREPLY=($(compgen -W "--source --resolution --frames --devices --mesh --texture --texture-views --json --verbose --quiet --help hand rabbit scalpel sphere bowl liver" -- "$cur") $(compgen -f -- "$cur")) ;;
    synth) COMPREPLY=($(compgen -W "--out --frames --fps --moving --size --turns --cameras --no-colors --noise-calibration --noise-sync --noise-segmentation --noise-depth --noise-wiggle --seed --help hand rabbit scalpel sphere bowl liver" -- "$cur") $(compgen -f -- "$cur")) ;;
    bench) COMPREPLY=($(compgen -W "all hull texture --devices --json --help" -- "$cur")) ;;
    info) COMPREPLY=($(compgen -W "--json --help" -- "$cur")) ;;
  esac
}
complete -o filenames -F _tactus tactus
