# shellcheck shell=bash disable=SC2034,SC2154 # variables of the script that sources it
# What run-in-kernel and run-in-qemu have in common; to be sourced. Needs: $program, $here, and defaults for $memory, $limit.
vivid=2 loop=0 udev=0 log='' card=() writable=("$PWD") job='' vivid_words=()

rig_usage() {
  sed -n '2,/^set/s/^# \{0,1\}//p' "$here/$program" >&2
  exit 2
}

# Takes the options both know and those of rig_own_option (exit status 1: unknown; 2: took a value). Leaves ${command[@]}.
rig_options() {
  while [[ ${1-} == --* ]]; do
    if [[ $1 == --vivid-loop ]]; then
      loop=1
    elif [[ $1 == --udev ]]; then
      udev=1
    elif [[ $1 == -- ]]; then
      shift
      break
    elif [[ $# -lt 2 ]]; then
      echo "$program: $1 is unknown, or wants a value" >&2
      exit 2
    else
      case $1 in
        --rw) writable+=("$(realpath "$2")") ;;
        --mem) memory=$2 ;;
        --timeout) limit=$2 ;;
        --vivid) vivid=$2 ;;
        --card) read -ra card <<<"$2" ;;
        --dmesg) log=$2 ;;
        *)
          if ! rig_own_option "$1" "$2"; then
            echo "$program: unknown option $1" >&2
            exit 2
          fi
          ;;
      esac
      shift
    fi
    shift
  done
  [[ $# -gt 0 ]] || rig_usage
  command=("$@")
}

# The folder through which the first process inside learns what to do and says how it ended.
rig_job() {
  job=$(mktemp -d)
  {
    export -p | grep -vE '^declare -x (TMPDIR|OLDPWD|SHLVL)'
    printf 'cd %q\n' "$PWD"
    printf '%q ' "${command[@]}"
    echo
  } >"$job/command"
  printf '%s\n' "${writable[@]}" >"$job/writable"
  printf 'udev=%q\n' "$udev" >"$job/options"
}

# Of each vivid instance: capture only, a plain webcam; or capture and output, both HDMI.
rig_vivid() {
  local each=() words
  each() { printf "$1%.0s" $(seq "$vivid"); }
  if [[ $loop == 1 ]]; then
    each=("node_types=$(each 0x101,)" "num_inputs=$(each 1,)" "input_types=$(each 3,)" "num_outputs=$(each 1,)" "output_types=$(each 1,)")
  else
    each=("node_types=$(each 0x1,)")
  fi
  vivid_words=("n_devs=$vivid")
  for words in "${each[@]}"; do vivid_words+=("${words%,}"); done
}

# Waits for the machine, process $1, and exits with the command's status.
rig_end() {
  local deadline=$((SECONDS + limit))
  while kill -0 "$1" 2>/dev/null; do
    if [[ $SECONDS -ge $deadline ]]; then
      echo "$program: no end after $limit s" >&2
      [[ -z $log ]] || cp "$job/console" "$log"
      exit 124
    fi
    sleep 0.05
  done
  wait "$1" || true
  rig_drained
  [[ -z $log ]] || cat "$job/console" "$job/dmesg" >"$log" 2>/dev/null || true
  if [[ ! -s $job/status ]]; then
    echo "$program: the kernel stopped without a status; its last words:" >&2
    tail -n 20 "$job/console" >&2 || true
    exit 125
  fi
  local status
  status=$(<"$job/status")
  # What a signal ended: the kernel knows the address, and where in which file that is.
  if [[ $status -gt 128 ]]; then
    echo "$program: ended by signal $((status - 128)); the kernel's last words:" >&2
    tail -n 10 "$job/dmesg" >&2 || true
  fi
  exit "$status"
}
