#!/usr/bin/env perl
# SPDX-License-Identifier: Apache-2.0
# Makes every register of one entity one that can be upset (not those of the entities inside).
#
#   upset.pl IN.v OUT.v SITES.inc
#
# IN.v is what GHDL makes of the entity. In OUT.v it has two more inputs: in the clock in which flip_site is the number
# of a register, what that register takes is changed where flip_mask has ones. 0: nothing happens. SITES.inc has a line
# for each: {name, bits}, number 1 first.
use strict;
use warnings;
my ($in, $out, $sites) = @ARGV;
die "usage: upset.pl IN.v OUT.v SITES.inc\n" unless @ARGV == 3;
open my $i, '<', $in or die "$in: $!\n";
my $text = do { local $/; <$i> };
close $i;

# Modules come before those that use them: the last one is the entity.
my $begin = rindex $text, "\nmodule ";
die "upset.pl: no module in $in\n" if $begin < 0 && $text !~ /^module /;
my $before = $begin < 0 ? '' : substr $text, 0, $begin + 1;
my $body = $begin < 0 ? $text : substr $text, $begin + 1;
my (%name, %bits, @list);
# Signals of the VHDL by the register behind them.
while ($body =~ /assign (\w+) = (n\d+_q);/g) { $name{$2} = $1 if !$name{$2} || $name{$2} =~ /^\w+_q$/ }
while ($body =~ /^  reg (?:\[(\d+):0\] )?(n\d+_q);/mg) { $bits{$2} = ($1 // 0) + 1 }
$body =~ s{^    (n\d+_q) <= (\w+);}{
  my ($register, $value, $width) = ($1, $2, $bits{$1});
  die "upset.pl: $register was not understood\n" if !$width || $width > 64;
  push @list, sprintf("{\"%s\", %d},\n", $name{$register} // $register, $width);
  "    $register <= $value ^ (flip_site == " . @list . " ? flip_mask[" . ($width - 1) . ":0] : ${width}'d0);"
}gme;
die "upset.pl: only " . @list . ' of ' . keys(%bits) . " registers were understood\n" if @list != keys %bits;
$body =~ s/^(module \w+\n)  \(/$1  (input [15:0] flip_site,\n   input [63:0] flip_mask,\n   /m
  or die "upset.pl: the ports were not understood\n";
for my $file ([$out, $before . $body], [$sites, join '', @list]) {
  open my $o, '>', $file->[0] or die "$file->[0]: $!\n";
  print $o $file->[1];
  close $o or die "$file->[0]: $!\n";
}
