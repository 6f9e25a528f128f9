# SPDX-License-Identifier: Apache-2.0
# Merges and reports what scripts/coverage.sh has counted.
#
#   coverage.pl lines OUT COUNT.json ..     GHDL's counts: a line is covered if any run has reached it
#   coverage.pl toggles OUT FILE ..         names of bits, '1' or '0' and a tabulator before each
#                                           (sw/simulator/coverage.hpp)
use strict;
use warnings;

my ($what, $out, @files) = @ARGV;
die "coverage: nothing was counted\n" unless defined $out && @files;
my @order;
for my $line (lines_of('rtl/files.f')) { push @order, $1 if $line =~ /^(\w+)\.vhd/ }

sub lines_of {
  my ($f) = @_;
  open my $in, '<', $f or die "coverage: $f: $!\n";
  my @l = <$in>;
  close $in;
  chomp @l;
  return @l;
}
sub spew { my ($f, @t) = @_; open my $o, '>', $f or die "coverage: $f: $!\n"; print $o @t; close $o or die "$f: $!\n" }
sub trimmed { my ($t) = @_; $t =~ s/--.*//; $t =~ s/\s+/ /g; $t =~ s/^ | $//g; return $t }

if ($what eq 'lines') { exit lines() }
if ($what eq 'toggles') { exit toggles() }
die "coverage: $what?\n";

sub lines {
  my %run;  # entity, line: 1 or 0
  my $limit = 95;
  for my $file (@files) {
    my $text = join "\n", lines_of($file);
    my $seen = 0;
    while ($text =~ /"file":\s*"(?:[^"]*\/)?(\w+)\.vhd",(.*?)"result":\s*\{([^}]*)\}/sg) {
      my ($entity, $result) = ($1, $3);
      next unless grep { $_ eq $entity } @order;
      while ($result =~ /"(\d+)":\s*(\d+)/g) {
        $run{$entity}{$1} = ($run{$entity}{$1} || $2 > 0) ? 1 : 0;
        $seen++;
      }
    }
    die "coverage: $file counts no line of rtl/\n" unless $seen;
  }

  # Explained holes: file, lines ('- ' and the text; as often as there are such holes), reason. By text alone: a number
  # of a line, or of its like in the file, would be another's after the next edit.
  my (%explained, @bad, $entity, @pending);
  my $list = 'scripts/coverage_holes.txt';
  my $n = 0;
  my $last_was_reason = 0;
  for my $line (lines_of($list)) {
    $n++;
    next if $line =~ /^#/ || $line !~ /\S/;
    if ($line =~ m{^rtl/(\w+)\.vhd$}) { $entity = $1; @pending = () }
    elsif ($line =~ /^- (.*\S)/ && $entity) {
      @pending = () if $last_was_reason;
      my $key = "$entity|" . trimmed($1);
      $explained{$key} //= {where => "$list:$n", reason => '', number => 0};
      $explained{$key}{number}++;
      push @pending, $key unless grep { $_ eq $key } @pending;
    }
    elsif ($line =~ /^  (\S.*)/ && @pending) {
      $explained{$_}{reason} .= "$1 " for @pending;
      $last_was_reason = 1;
      next;
    }
    else { die "coverage: $list:$n: not understood\n" }
    $last_was_reason = 0;
  }
  for my $e (values %explained) { push @bad, "$e->{where}: no reason" unless $e->{reason} }

  my ($all, $covered, @table, @holes, @lcov, %found) = (0, 0);
  for my $name (@order) {
    # Constants and functions of a package belong to elaboration; GHDL counts what it runs after that.
    if (!$run{$name}) { push @table, sprintf("%-20s %s\n", $name, 'no statement that GHDL counts'); next }
    my @text = lines_of("rtl/$name.vhd");
    my ($total, $hit) = (0, 0);
    push @lcov, "TN:\nSF:rtl/$name.vhd\n";
    for my $number (sort { $a <=> $b } keys %{$run{$name}}) {
      $total++;
      $hit += $run{$name}{$number};
      push @lcov, "DA:$number,$run{$name}{$number}\n";
      next if $run{$name}{$number};
      my $key = "$name|" . trimmed($text[$number - 1]);
      my $known = $explained{$key} && ++$found{$key} <= $explained{$key}{number};
      push @holes, sprintf("rtl/%s.vhd:%d: %s\n    %s\n", $name, $number, trimmed($text[$number - 1]),
                           $known ? $explained{$key}{reason} : 'NOT EXPLAINED');
      push @bad, "a hole that $list does not explain: rtl/$name.vhd:$number: " . trimmed($text[$number - 1])
        unless $known;
    }
    push @lcov, "end_of_record\n";
    push @table, sprintf("%-20s %5d of %5d  %6.2f %%\n", $name, $hit, $total, 100 * $hit / $total);
    $all += $total;
    $covered += $hit;
  }
  for my $key (sort keys %explained) {
    my $less = $explained{$key}{number} - ($found{$key} // 0);
    push @bad, "$explained{$key}{where}: $less more than there are holes" if $less > 0;
  }
  die "coverage: no line was counted\n" unless $all;
  my $percent = 100 * $covered / $all;
  my $sum = sprintf "%-20s %5d of %5d  %6.2f %%\n", 'all', $covered, $all, $percent;
  push @bad, sprintf("%.2f %% of the lines were run, %d %% are wanted", $percent, $limit) if $percent < $limit;
  spew("$out/lines.lcov", @lcov);
  spew("$out/lines.txt", "Lines of VHDL that were run\n\n", @table, $sum, "\nHoles\n\n", @holes, "\n");
  print @table, $sum;
  print "coverage: $_\n" for @bad;
  printf "coverage: %d of %d lines, %.2f %%, %d holes, %d problems\n", $covered, $all, $percent, scalar @holes,
    scalar @bad;
  return @bad ? 1 : 0;
}

sub toggles {
  my (%bit);
  for my $file (@files) {
    for my $line (lines_of($file)) {
      my ($changed, $name) = split /\t/, $line, 2;
      $bit{$name} = ($bit{$name} || $changed) ? 1 : 0;
    }
  }
  # module of the Verilog (the entity, or the entity and a hash of its generics): bits
  my (%total, %hit, %never);
  my $unknown = 0;
  for my $name (keys %bit) {
    my ($module, $signal) = split / /, $name, 2;
    my ($entity) = grep { $module eq $_ || $module =~ /^\Q$_\E_(?:[0-9a-f]{8,}|\d)/ }
      sort { length $b <=> length $a } @order;
    if (!$entity) { $unknown++; next }
    $total{$entity}++;
    $hit{$entity} += $bit{$name};
    (my $base = $signal) =~ s/\[.*//;
    $never{$entity}{$base} = ($never{$entity}{$base} || $bit{$name}) ? 1 : 0;
  }
  my ($all, $changed, @table, @silent) = (0, 0);
  for my $name (@order) {
    if (!$total{$name}) { push @table, sprintf("%-20s %s\n", $name, 'no signal of its own'); next }
    push @table, sprintf("%-20s %6d of %6d  %6.2f %%\n", $name, $hit{$name}, $total{$name},
      100 * $hit{$name} / $total{$name});
    $all += $total{$name};
    $changed += $hit{$name};
    push @silent, map { "$name.$_\n" } grep { !$never{$name}{$_} } sort keys %{$never{$name}};
  }
  die "coverage: no bit was counted\n" unless $all;
  my $sum = sprintf "%-20s %6d of %6d  %6.2f %%\n", 'all', $changed, $all, 100 * $changed / $all;
  spew("$out/toggles.txt", "Bits that changed, in all configurations together\n\n", @table, $sum,
       "\nSignals of which no bit changed in any configuration\n\n", @silent, "\n");
  print @table, $sum;
  printf "coverage: %d of %d bits changed, %.2f %%; %d signals never did%s\n", $changed, $all, 100 * $changed / $all,
    scalar @silent, $unknown ? "; $unknown bits of unknown modules" : '';
  return $unknown ? 1 : 0;
}
