#!/usr/bin/env perl
# SPDX-License-Identifier: Apache-2.0
# Every range that an entity asserts of a generic is tried just outside: GHDL has to stop with the entity's own message,
# which names the generic; in simulation, with one value an entity, it has to stop as well, and most say the value. The
# values follow from the message, so no new range is forgotten.
#
#   illegal_generics.pl RTL_FOLDER WORK_FOLDER GHDL
#
# Ends with 'N values of N generics refused'; exit code 1 if one was not, if a message is not understood, or if an
# entity of several generics asserts nothing.
use strict;
use warnings;
my ($rtl, $work, $ghdl) = @ARGV;
die "usage: illegal_generics.pl RTL_FOLDER WORK_FOLDER GHDL\n" unless @ARGV == 3;

sub slurp { my ($f) = @_; open my $i, '<', $f or die "$f: $!\n"; local $/; return <$i> }
# Messages that are not about a range, and values that they are for.
my %special = (
  'is not 1, 2 or 4'                       => [3, 5, 8],
  'is neither 0 nor 1'                     => [-1, 2],
  'is neither 2 nor 4'                     => [3, 5],
  'is neither 0 nor from 2 on'             => [-1, 1],
  'holds no pair or no cell'               => [1],
  'is no multiple of 9 up to G_DATA_W'     => [8],
  'is neither G_CELLS nor one or more chunks' => [7],
);
my @sources = map { s/\s*#.*//r } split /\n/, slurp("$rtl/files.f");
@sources = grep { /\S/ } @sources;
mkdir $work;
system($ghdl, '-a', '--std=93', "--workdir=$work", map { "$rtl/$_" } @sources) == 0 or die "GHDL failed\n";

my ($values, $generics, $failed, $told, %simulated) = (0, 0, 0, 0);
for my $file (@sources) {
  (my $entity = $file) =~ s/\.vhd$//;
  my $text = slurp("$rtl/$file");
  my %default;
  $default{$1} = $2 while $text =~ /^\s+(G_\w+)\s*:\s*integer\s*:=\s*(-?\d+)/mg;
  my %seen;
  # The value stands between translate_off and translate_on: GHDL as a synthesis tool leaves it out, as a simulator not.
  my ($off, $on) = ('-- synthesis translate_off', '-- synthesis translate_on');
  $text =~ s/"\s+$off\s+& "=" & (integer'image\(\w+\))\s+$on\s+& "/=" & $1 & "/g;
  while ($text =~ /report "(\w+): (G_\w+)=" & integer'image\(\2\) & " ([^"]*)"/g) {
    my ($who, $generic, $rule) = ($1, $2, $3);
    die "$file: a message of $who\n" if $who ne $entity;
    my @try;
    if ($special{$rule}) { @try = @{$special{$rule}} }
    elsif ($rule =~ /^below (-?\d+)$/) { @try = ($1 - 1) }
    elsif ($rule =~ /^outside (\w+)\.\.(\w+)( or odd| or even| or over .*)?$/) {
      my ($low, $high, $more) = ($1, $2, $3 // '');
      $low = $default{$low} if $low =~ /^G_/;
      @try = ($low - 1, $high + 1, $more =~ /odd|even/ ? $low + 1 : ());
    } else { die "$file: '$rule' is not understood\n" }
    $generics++ unless $seen{$generic}++;
    for my $value (@try) {
      my $said = qx($ghdl --synth --std=93 --workdir=$work -g$generic=$value --out=none $entity 2>&1);
      my $bad = $? == 0 ? "is not refused\n" : $said =~ /\Q$entity: $generic\E(?:=\Q$value\E)? \Q$rule\E/ ? ''
        : "stops, but with another message:\n" . substr($said =~ s/^/  /mgr, 0, 600);
      # A simulator must stop, too; what the value breaks may be noticed before the assertion. One value an entity.
      if (!$simulated{$entity}++) {
        $said = qx($ghdl -r --std=93 --workdir=$work $entity -g$generic=$value --stop-time=1ns 2>&1);
        $bad .= "does not stop a simulation\n" if $? == 0;
        $told++ if $said =~ /\Q$entity: $generic=$value $rule\E/;
      }
      $values++;
      next if $bad eq '';
      print "$entity: $generic=$value $bad";
      $failed++;
    }
  }
  print "$file: generics without an assertion\n" and $failed++ if %default && !%seen && keys %default > 1;
}
print $values - $failed, " of $values values of $generics generics refused\n";
print "$told of ", scalar keys %simulated, " entities say so in simulation, with the value\n";
exit($failed || !$values || !$told ? 1 : 0);
