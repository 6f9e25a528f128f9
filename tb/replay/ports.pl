#!/usr/bin/env perl
# SPDX-License-Identifier: Apache-2.0
# Reads the ports of a circuit and writes what replays or records them, so that no list of ports is kept by hand.
#
#   ports.pl bench ENTITY.vhd TEMPLATE [CLOCK ..] [-OPEN]   VHDL bench: TEMPLATE (replay.vhd.in) filled in
#   ports.pl gates MODULE.v MODULE ENTITY.vhd TEMPLATE CLOCK [-OPEN]  the same in Verilog: tb/gates/replay.v.in
#   ports.pl pins ENTITY.vhd                                C++: struct Pins, a member for each port
#   ports.pl widths MODULE.v MODULE                         C++: {"name", bits}, of the ports of converted Verilog
#   -OPEN: ports whose names begin with OPEN are left open
#
# Ends with an error if a line of the generics or ports is not understood: none may get lost.
use strict;
use warnings;

sub slurp {
    my ($file) = @_;
    open my $in, '<', $file or die "ports.pl: $file: $!\n";
    local $/ = undef;
    return scalar <$in>;
}

# Name, generics [name, default], ports {name, input, range}; the range of a std_logic is ''.
sub entity_of {
    my ($file) = @_;
    my $text = slurp($file);
    $text =~ s/--.*//g;
    $text =~ /\bentity\s+(\w+)\s+is\b(.*?)\bend\s+entity\b/s or die "ports.pl: $file has no entity\n";
    my ($name, $body) = ($1, $2);
    my ($generic_part, $port_part) = $body =~ /^\s*(?:generic\s*\((.*?)\)\s*;\s*)?port\s*\((.*)\)\s*;\s*$/s
      or die "ports.pl: $file: entity $name is not understood\n";
    my (@generics, @ports);
    for my $item (split /;/, $generic_part // '') {
        $item =~ /^\s*(\w+)\s*:\s*integer\s*:=\s*(-?\d+)\s*$/
          or die "ports.pl: $file: generic not understood: $item\n";
        push @generics, [$1, $2];
    }
    for my $item (split /;/, $port_part) {
        $item =~ /^\s*(\w+)\s*:\s*(in|out)\s+std_logic(?:_vector\s*\((.*)\))?\s*$/s
          or die "ports.pl: $file: port not understood: $item\n";
        push @ports, {name => $1, input => $2 eq 'in', range => $3 // ''};
    }
    return ($name, \@generics, \@ports);
}

# Ports {name, input, bits} of a module as GHDL and Yosys write them.
sub module_of {
    my ($file, $name) = @_;
    my $text = slurp($file);
    $text =~ /^module\s+\Q$name\E\s*\((.*?)\)\s*;(.*?)^endmodule/ms or die "ports.pl: $file has no module $name\n";
    my ($head, $body) = ($1, $2);
    my @ports;
    my $range = qr/(?:\[\s*(\d+)\s*:\s*0\s*\]\s*)?/;
    if ($head =~ /\b(?:input|output)\b/) {
        for my $item (split /,/, $head) {
            $item =~ /^\s*(input|output)\s+(?:wire\s+|reg\s+)?$range(\w+)\s*$/
              or die "ports.pl: $file: port not understood: $item\n";
            push @ports, {name => $3, input => $1 eq 'input', bits => ($2 // 0) + 1};
        }
    } else {
        my %seen;
        while ($body =~ /^\s*(input|output)\s+$range(\w+)\s*;/mg) {
            $seen{$3} = {name => $3, input => $1 eq 'input', bits => ($2 // 0) + 1};
        }
        for my $item (split /,/, $head) {
            $item =~ s/\s//g;
            push @ports, $seen{$item} // die "ports.pl: $file: port $item not found\n";
        }
    }
    return \@ports;
}

# Replaces each @KEY@ of a template.
sub fill {
    my ($template, %values) = @_;
    my $text = slurp($template);
    $text =~ s/\@(\w+)\@/$values{$1} \/\/ die "ports.pl: $template: \@$1\@ is not known\n"/ge;
    print $text;
    return;
}

sub bench {
    my ($file, $template, @clocks) = @_;
    my ($open) = map { /^-(.*)/ ? $1 : () } @clocks;
    @clocks = grep { !/^-/ } @clocks;
    my ($name, $generics, $ports) = entity_of($file);
    my %is_clock = map { $_ => 1 } @clocks;
    my @used = grep { !(defined $open && $_->{name} =~ /^\Q$open\E/) } @$ports;
    my @inputs = grep { $_->{input} && !$is_clock{$_->{name}} } @used;
    my @outputs = grep { !$_->{input} } @used;
    die "ports.pl: $name: no input, no output or not this clock\n"
      unless @inputs && @outputs && @clocks == grep { $is_clock{$_->{name}} } @used;

    my $vector = sub { $_[0]{range} eq '' ? '0 downto 0' : $_[0]{range} };
    my $type = sub { $_[0]{range} eq '' ? 'std_logic' : "std_logic_vector($_[0]{range})" };
    my %v = (TOP => $name, OUTPUTS => scalar @outputs, CLOCKS => scalar @clocks);
    $v{GENERICS} = join '', map { "    $_->[0] : integer := $_->[1];\n" } @$generics;
    $v{GENERIC_MAP} = @$generics ? "    generic map (\n" . join(",\n", map { "      $_->[0] => $_->[0]" } @$generics)
      . "\n    )\n" : '';
    $v{GENERIC_CHECKS} = join '', map { "        generic_is(\"$_->[0]\", $_->[0]);\n" } @$generics;
    $v{SIGNALS} = join '', map {
        my $start = !$_->{input} ? '' : $_->{range} eq '' ? " := '0'" : " := (others => '0')";
        "  signal $_->{name} : " . $type->($_) . "$start;\n"
    } @used;
    $v{PORT_MAP} = join ",\n", map { "      $_->{name} => $_->{name}" } @used;
    $v{EXPECTATIONS} = join '', map {
        "    variable v_$_->{name} : std_logic_vector(" . $vector->($_) . ") := (others => '-');\n"
    } @outputs;
    $v{HEADER} = join '', (map { "    port_is(\"clock\", \"$_\", 1);\n" } @clocks),
      map { "    port_is(\"" . ($_->{input} ? 'in' : 'out') . "\", \"$_->{name}\", "
          . ($_->{range} eq '' ? '1' : "$_->{name}'length") . ");\n" } @inputs, @outputs;
    $v{DRIVE} = join '', map { "      next_field;\n      drive($_->{name});\n" } @inputs;
    $v{EXPECT} = join '', map { "      next_field;\n      expect(v_$_->{name});\n" } @outputs;
    my $number = 0;
    $v{COMPARE} = join '', map {
        my $is = $_->{range} eq '' ? "(0 => $_->{name})" : $_->{name};
        "        compare(" . $number++ . ", \"$_->{name}\", $is, v_$_->{name});\n"
    } @outputs;
    $number = 0;
    $v{SEEN} = join '', map { '    seen(' . $number++ . ", \"$_->{name}\");\n" } @outputs;
    $number = 0;
    $v{RISE} = join '', map { "        $_ <= v_rises(" . $number++ . ");\n" } @clocks;
    $v{FALL} = join '', map { "        $_ <= '0';\n" } @clocks;
    fill($template, %v);
    return;
}

# Widths from the module, order of the ports (that of a recording) from the entity.
sub gates {
    my ($file, $module, $entity, $template, $clock, $open) = @_;
    $open = defined $open ? $open =~ s/^-//r : undef;
    my (undef, undef, $ports) = entity_of($entity);
    my %bits = map { $_->{name} => $_->{bits} } @{module_of($file, $module)};
    for my $port (@$ports) {
        $port->{bits} = delete $bits{$port->{name}} // die "ports.pl: $file: no port $port->{name}\n";
    }
    die "ports.pl: $file has ports that $entity has not: @{[sort keys %bits]}\n" if %bits;
    my @inputs = grep { $_->{input} && $_->{name} ne $clock } @$ports;
    my @recorded = grep { !$_->{input} } @$ports;
    my $is_open = sub { defined $open && $_[0]{name} =~ /^\Q$open\E/ };
    my @outputs = grep { !$is_open->($_) } @recorded;
    die "ports.pl: $module: no input, no output or no clock $clock\n"
      unless @inputs && @outputs && 1 == grep { $_->{name} eq $clock && $_->{bits} == 1 } @$ports;

    my $range = sub { $_[0]{bits} == 1 ? '' : '[' . ($_[0]{bits} - 1) . ':0] ' };
    my $take = sub {
        my ($port, @targets) = @_;
        return "      next_word;\n      if (word != \".\") begin\n        to_bits($port->{bits});\n        "
          . join(' ', @targets) . "\n      end\n";
    };
    my %v = (TOP => $module, CLOCK => $clock);
    $v{SIGNALS} = "  reg $clock = 0;\n" . join('', map { "  reg " . $range->($_) . "$_->{name} = 0;\n" } @inputs)
      . join '', map {
        '  wire ' . $range->($_) . "$_->{name};\n  reg " . $range->($_) . "want_$_->{name} = 0, care_$_->{name} = 0;\n"
          . "  reg seen_$_->{name} = 0;\n"
      } @outputs;
    $v{PORT_MAP} = join ",\n", map { "    .$_->{name}($_->{name})" } grep { $_->{input} || !$is_open->($_) } @$ports;
    $v{HEADER} = join '', map {
        "    port_is(\"" . ($_->{input} ? 'in' : 'out') . "\", \"$_->{name}\", $_->{bits});\n"
    } @inputs, @recorded;
    $v{DRIVE} = join '', map { $take->($_, "$_->{name} = value;") } @inputs;
    $v{EXPECT} = join '', map {
        $is_open->($_) ? $take->($_) : $take->($_, "want_$_->{name} = value;", "care_$_->{name} = known;")
    } @recorded;
    $v{COMPARE} = join '', map {
        my $n = $_->{name};
        "        if (care_$n != 0) begin\n          seen_$n = 1;\n          compared = compared + 1;\n"
          . "          if (((want_$n ^ $n) & care_$n) !== 0) differs(\"$n\", $n, want_$n, care_$n, $_->{bits});\n"
          . "        end\n"
    } @outputs;
    $v{SEEN} = join '', map { "    if (!seen_$_->{name}) refuse(\"port $_->{name} was never compared\");\n" } @outputs;
    fill($template, %v);
    return;
}

# Verilator's type for a port of this range, the widest where it depends on generics.
sub verilated_type {
    my ($range) = @_;
    my $top = $range eq '' ? 0 : $range =~ /^(\d+) downto 0$/ ? $1 : 63;
    return $top < 8 ? 'CData' : $top < 16 ? 'SData' : $top < 32 ? 'IData' : 'QData';
}

sub pins {
    my ($file) = @_;
    my ($name, undef, $ports) = entity_of($file);
    print "// SPDX-License-Identifier: Apache-2.0\n",
      "// Generated by tb/replay/ports.pl: the ports of entity $name, as wide as any configuration needs.\n",
      "#pragma once\n#include <verilated.h>\n\n#include <type_traits>\n\nnamespace psweep::replay {\n\nstruct Pins {\n",
      (map { '  ' . verilated_type($_->{range}) . " $_->{name} = 0;\n" } @$ports),
      "\n  // f(name, is it an input, value)\n  template <class F>\n  void each(F&& f) const {\n",
      (map { "    f(\"$_->{name}\", " . ($_->{input} ? 'true' : 'false') . ", QData{$_->{name}});\n" } @$ports),
      "  }\n  template <class Dut>\n  void drive(Dut& dut) const {\n",
      (map { $_->{input}
            ? "    dut.$_->{name} = static_cast<std::remove_reference_t<decltype(dut.$_->{name})>>($_->{name});\n"
            : () } @$ports),
      "  }\n  template <class Dut>\n  void sample(const Dut& dut) {\n",
      (map { $_->{input} ? () : "    $_->{name} = dut.$_->{name};\n" } @$ports),
      "  }\n};\n\n}  // namespace psweep::replay\n";
    return;
}

my $mode = shift @ARGV // '';
if ($mode eq 'bench' && @ARGV >= 3) {
    bench(@ARGV);
} elsif ($mode eq 'pins' && @ARGV == 1) {
    pins(@ARGV);
} elsif ($mode eq 'gates' && (@ARGV == 5 || @ARGV == 6)) {
    gates(@ARGV);
} elsif ($mode eq 'widths' && @ARGV == 2) {
    print "// Generated by tb/replay/ports.pl.\n";
    print "{\"$_->{name}\", $_->{bits}},\n" for @{module_of(@ARGV)};
} else {
    print {$mode eq '--help' ? *STDOUT : *STDERR} map { /^# ?(.*\n)/ ? $1 : () } (split /^/, slurp($0))[2 .. 11];
    exit($mode eq '--help' ? 0 : 2);
}
