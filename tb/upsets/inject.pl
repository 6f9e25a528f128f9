#!/usr/bin/env perl
# SPDX-License-Identifier: Apache-2.0
# Makes every register and RAM of a converted engine one that can be upset.
#
#   inject.pl IN.v OUT.v SITES.inc
#
# IN.v is what GHDL makes of psweep. In OUT.v the top has three more inputs: in the clock in which flip_site is the
# number of a register, what that register takes is changed where flip_mask has ones; likewise word flip_word of a RAM.
# 0: nothing happens. SITES.inc has a line for each: {entity, name, bits, words (0: a register)}, number 1 first.
# Modules with several instances are left out, as one upset would hit all of them; of vectors only the low 64 bits.
use strict;
use warnings;
my ($in, $out, $sites) = @ARGV;
die "usage: inject.pl IN.v OUT.v SITES.inc\n" unless @ARGV == 3;
open my $i, '<', $in or die "$in: $!\n";
my $text = do { local $/; <$i> };
close $i;

# How often each module is in the engine; modules come before those that use them.
my (%instance, %parent, @uses);
while ($text =~ /^module (\w+)\b(.*?)^endmodule/gms) {
  my ($parent, $body) = ($1, $2);
  while ($body =~ /^  (\w+) (\w+) \(\s*$/mg) {
    unshift @uses, [$parent, $1];
    $instance{$1} = $2;
    $parent{$1} = $parent;
  }
}
my %instances = (psweep => 1);
$instances{$_->[1]} += $instances{$_->[0]} // 0 for @uses;
my @names = sort { length $b <=> length $a } qw(control address_generator storage interpolation similarity updating
  divider divider_mul delay_line stream_fifo ram_sdp ram_2r ram_wide psweep);

my (@list, $count);
$text =~ s{^(module (\w+)\b.*?^endmodule)}{edit($2, $1)}gmse;
sub edit {
  my ($module, $body) = @_;
  my ($entity) = grep { $module =~ /^\Q$_\E(_\d|$)/ } @names;
  return $body if !defined $entity || $module eq 'psweep' || ($instances{$module} // 0) != 1;
  # Common cells are known by what they are in their only instance.
  my $where = $entity =~ /^(divider|delay_line|stream_fifo|ram_)/ ? "$instance{$module}." : '';
  # A part of a ram_deep is known by what the whole is.
  $where = "$instance{$parent{$module}}." if $where =~ /u_part\.$/;
  # Signals of the VHDL by the register behind them.
  my %name;
  while ($body =~ /assign (\w+) = (n\d+_q);/g) { $name{$2} = $1 if !$name{$2} || $name{$2} =~ /^\w+_q$/ }
  my %bits;
  while ($body =~ /^  reg (?:\[(\d+):0\] )?(n\d+_q);/mg) { $bits{$2} = ($1 // 0) + 1 }
  $body =~ s{^    (n\d+_q) <= (\w+);}{
    my ($register, $value) = ($1, $2);
    if ($bits{$register}) {
      my $number = site($entity, $where . ($name{$register} // $register), $bits{$register}, 0);
      "    $register <= $value ^ (psweep.flip_site == $number ? " . mask($bits{$register}) . " : $bits{$register}'d0);"
    } else { "    $register <= $value;" }
  }gme;
  # None of control may get lost, however the converter writes it.
  if ($entity eq 'control') {
    while ($body =~ /^  reg (?:\[\d+:0\] )?(\w+)/mg) {
      $body =~ /^    \Q$1\E <= \w+ \^ \(psweep\.flip_site == /m
        or die "inject.pl: register $1 of control was not understood\n";
    }
  }
  if ($entity =~ /^ram_/ && $body =~ /reg (?:\[(\d+):0\] )?((?:\w+_)?memory)\[(\d+):0\]/) {
    my ($width, $memory, $words) = (($1 // 0) + 1, $2, $3 + 1);
    my $number = site($entity, "${where}memory", $width, $words);
    my $word = 'psweep.flip_word[' . (length(sprintf '%b', $words - 1) - 1) . ':0]';
    $body =~ s{always \@\(posedge clk\)\n    if \(we\)\n      $memory\[waddr\] <= wdata;}
              {always \@(posedge clk) begin
    if (we)
      ${memory}[waddr] <= wdata;
    if (psweep.flip_site == $number)
      ${memory}[$word] <= ${memory}[$word] ^ @{[mask($width)]};
  end} or die "inject.pl: the write port of $module was not understood\n";
  }
  return $body;
}
sub mask {
  my ($bits) = @_;
  return $bits > 64 ? '{' . ($bits - 64) . "'d0, psweep.flip_mask}" : 'psweep.flip_mask[' . ($bits - 1) . ':0]';
}
sub site {
  my ($entity, $name, $bits, $words) = @_;
  push @list, sprintf("{\"%s\", \"%s\", %d, %d},\n", $entity, $name, $bits > 64 ? 64 : $bits, $words);
  return scalar @list;
}
my $ports = "  (input [15:0] flip_site,\n   input [15:0] flip_word,\n   input [63:0] flip_mask,\n";
$text =~ s/^(module psweep\n)  \(/$1$ports/m or die "inject.pl: no module psweep\n";
die "inject.pl: no register of control\n" unless grep { /"control"/ } @list;
for my $file ([$out, $text], [$sites, join '', @list]) {
  open my $o, '>', $file->[0] or die "$file->[0]: $!\n";
  print $o $file->[1];
  close $o or die "$file->[0]: $!\n";
}
