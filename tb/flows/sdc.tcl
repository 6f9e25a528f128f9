# SPDX-License-Identifier: Apache-2.0
# Reads an SDC file as a timing tool would, with the commands that scripts/check_flows.py knows:
#   tclsh sdc.tcl FILE PORTS [clk_period]     PORTS: a file with a bit a line ('mii_rxd[0]')
# Prints a line for each statement, fields separated by tabs. Unknown command, option, port or clock, wrong number of
# arguments: an error.
set clocks {}
set handle [open [lindex $argv 1]]
set ports [split [string trim [read $handle]] "\n"]
close $handle

proc get_ports {patterns} {
  set found {}
  foreach pattern $patterns {
    set matched 0
    set glob [string map {[ \\[ ] \\]} $pattern]
    foreach port $::ports {
      if {[string match $glob $port] || [string match "$glob\\\[*\\\]" $port]} {
        lappend found $port
        set matched 1
      }
    }
    if {!$matched} { error "no port $pattern" }
  }
  return $found
}
# Marked, because a port may have the same name.
proc get_clocks {names} {
  set found {}
  foreach name $names {
    if {$name ni $::clocks} { error "no clock $name" }
    lappend found "clock:$name"
  }
  return $found
}
# Options with a value, options without one, number of other arguments.
proc statement {name with without number arguments} {
  set options {}
  set rest {}
  while {[llength $arguments]} {
    set word [lindex $arguments 0]
    set arguments [lrange $arguments 1 end]
    if {$word in $with && [llength $arguments]} {
      lappend options $word [lindex $arguments 0]
      set arguments [lrange $arguments 1 end]
    } elseif {$word in $without} {
      lappend options $word 1
    } elseif {[string match -* $word] && ![string is double -strict $word]} {
      error "$name: unknown option $word"
    } else {
      lappend rest $word
    }
  }
  if {[dict exists $options -clock]} { get_clocks [dict get $options -clock] }
  if {[llength $rest] != $number} { error "$name: [llength $rest] arguments instead of $number" }
  puts [join [concat [list $name] $options [list {}] $rest] "\t"]
  return $options
}
proc create_clock {args} {
  set options [statement create_clock {-name -period} {} 1 $args]
  lappend ::clocks [dict get $options -name]
}
proc set_max_delay {args} { statement set_max_delay {-from -to} {} 1 $args }
proc set_false_path {args} {
  if {"-from" ni $args && "-to" ni $args} { error "set_false_path: from anything to anything" }
  statement set_false_path {-from -to} {-hold} 0 $args
}
proc set_input_delay {args} { statement set_input_delay {-clock} {-max -min} 2 $args }
proc set_output_delay {args} { statement set_output_delay {-clock} {-max -min} 2 $args }

if {[llength $argv] > 2} { set clk_period [lindex $argv 2] }
source [lindex $argv 0]
