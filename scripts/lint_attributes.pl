#!/usr/bin/perl
# SPDX-License-Identifier: Apache-2.0
# The table 'Attributes' of docs/flows.md lists all attributes for the FPGA tools that are in the VHDL, and they are all
# there, with these values: constants of psweep_pkg, or literals in entities that use no package. For lint.sh.
#
#   scripts/lint_attributes.pl
#
# Prints what differs, exit code 1 if anything does or if nothing was compared.
use strict;
use warnings;

sub slurp { my ($file) = @_; open my $in, '<', $file or die "$file: $!\n"; local $/; return <$in> }

my ($table) = slurp('docs/flows.md') =~ /^## Attributes\n(.*?)(?=^## |\z)/ms or die "docs/flows.md: no 'Attributes'\n";
my (%listed, %written, $bad);
for my $row ($table =~ /^\|(.*)\|$/mg) {
    my ($attribute, $value, $entity, $signals) = map { s/^\s+|\s+$//gr } split /\|/, $row;
    next if $attribute =~ /^(attribute|-+)$/;
    $listed{"$entity.$_: $attribute is $value"} = 1 for split /, */, $signals;
}
my %constant = slurp('rtl/psweep_pkg.vhd') =~ /^  constant (C_\w+) *: string *:= "(\w+)"/mg;
for my $file (glob 'rtl/*.vhd') {
    my ($entity) = $file =~ m{(\w+)\.vhd$};
    my $text = slurp($file) =~ s/--[^\n]*//gr;
    while ($text =~ /\battribute\s+(\w+)\s+of\s+([^:;]*?)\s*:\s*signal\s+is\s+([^;]*?)\s*;/g) {
        my ($attribute, $signals, $value) = ($1, $2, $3);
        if ($value =~ /^"(.*)"$/) { $value = $1 }
        elsif (!$constant{$value}) { print "$file: $value is no constant of psweep_pkg\n"; $bad = 1 }
        for my $signal (split /\s*,\s*/, $signals) {
            my $line = "$entity.$signal: $attribute is $value";
            $written{$line} = 1;
            if ($text !~ /\bsignal\s+(?:\w+\s*,\s*)*\Q$signal\E\b/) { print "$file: no signal $signal\n"; $bad = 1 }
        }
    }
}
for my $line (sort keys %written) { if (!$listed{$line}) { print "not in docs/flows.md: $line\n"; $bad = 1 } }
for my $line (sort keys %listed) { if (!$written{$line}) { print "not in the VHDL: $line\n"; $bad = 1 } }
if (!%written) { print "no attribute found\n"; $bad = 1 }
exit($bad ? 1 : 0);
