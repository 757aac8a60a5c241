# Completion of the command ignis.
_ignis() {
  local word="${COMP_WORDS[COMP_CWORD]}"
  if [ "$COMP_CWORD" = 1 ]; then
    mapfile -t COMPREPLY < <(compgen -W "up down status doctor echo hz spy reset l1 mount-check run help" -- "$word")
    return
  fi
  case "${COMP_WORDS[1]}" in
    status) mapfile -t COMPREPLY < <(compgen -W "--once --seconds --lcm-url --help" -- "$word") ;;
    doctor) mapfile -t COMPREPLY < <(compgen -W "--json --config --port --seconds --folder --help" -- "$word") ;;
    l1) mapfile -t COMPREPLY < <(compgen -W "standby normal version led decode mount-check" -- "$word") ;;
    run)
      [ "$COMP_CWORD" != 2 ] || mapfile -t COMPREPLY < <(compgen -W "$(ls /usr/lib/ignis-lio/bin)" -- "$word")
      ;;
    echo)
      mapfile -t COMPREPLY < <(compgen -W "L1_IMU L1_SCAN L1_STATUS LIO_STATE LIO_SCAN_STATS LIO_CLOUD LIO_CLOUD_AGAIN \
LIO_KEYFRAME KEYFRAME_REQUEST CLOUD_REQUEST LIO_COMMAND GRAPH_COMMAND SMOOTHED_KEYFRAMES SMOOTHED_STATE LOOP_RESULT \
MAP_STATUS GROUND_TRUTH HEALTH" -- "$word")
      ;;
  esac
}
complete -o default -F _ignis ignis
