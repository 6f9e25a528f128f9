#!/usr/bin/env perl
# SPDX-License-Identifier: Apache-2.0
# The pages docs/<entity>.md: contract, diagram; tables of generics and ports against the entities of the VHDL.
#
#   scripts/lint_tables.pl [--docs DIR] FILE.vhd ...
#   scripts/lint_tables.pl --rows FILE.vhd ...   what the tables have to say, meanings left blank
#
# A page has one table '| generic | default | range | meaning, cost |' if the entity has generics, and one or more
# tables '| port | dir | width | meaning |'. Each generic has a row with the entity's default and the range that its
# assertion states: 'a .. b', 'a .. b, even', 'a, b', 'from a', or the condition itself. A generic that the entity hands
# down as it is has the range of the entity that checks it; 'any' if nobody does. Each port has a row with its
# direction and width; ports alike may share a row, separated by commas. Nothing else may be in these tables.
# '## Contract' is a table with the rows rate, latency, formats, reset, corner cases and cost; '## Diagram' a block of
# text or a picture.
use strict;
use warnings;

my ($docs, $rows, @files) = ('docs', 0);
while (@ARGV) {
    my $argument = shift;
    if    ($argument =~ /^(-h|--help)$/) { open my $self, '<', $0; <$self>;
        while (<$self>) { last unless s/^# ?//; print unless /^SPDX/ } exit 0 }
    elsif ($argument eq '--docs') { $docs = shift // die "lint_tables: --docs needs a folder\n" }
    elsif ($argument eq '--rows') { $rows = 1 }
    else  { push @files, $argument }
}
my ($bad, %entities, @order) = (0);
sub complain { print "@_\n"; $bad = 1 }
sub squeeze { my $text = shift; $text =~ s/\s+/ /g; $text =~ s/^ | $//g; return $text }

# 'X - 1 downto 0' has X bits.
sub width_of {
    my $type = squeeze(shift);
    return '1' if $type =~ /^std_logic$/i;
    return undef unless $type =~ /^std_logic_vector\s*\((.*) downto 0\)$/i;
    my $left = squeeze($1);
    return $1 if $left =~ /^(.*) - 1$/;
    return $left + 1 if $left =~ /^\d+$/;
    return "$1 + " . ($2 + 1) if $left =~ /^(.*) \+ (\d+)$/;
    return "$left + 1";
}

# The condition of an assertion about generic $name, as a range.
sub range_of {
    my ($name, $condition) = @_;
    return "$1 .. $2" if $condition =~ /^$name >= (\w+) and $name <= (\w+)$/;
    return "$1 .. $2, " . ($3 ? 'odd' : 'even')
        if $condition =~ /^$name >= (\w+) and $name <= (\w+) and $name mod 2 = ([01])$/;
    return "from $1" if $condition =~ /^$name >= (\w+)$/;
    my @parts = map { /^$name = (\w+)$/ ? $1 : undef } split / or /, $condition;
    return join ', ', @parts unless grep { !defined } @parts;
    return "`$condition`";
}

sub parse_entity {
    my $file = shift;
    open my $in, '<', $file or die "lint_tables: $file: $!\n";
    my $text = join '', <$in>;
    $text =~ s/--[^\n]*//g;
    return unless $text =~ /\bentity\s+(\w+)\s+is\b(.*?)\bend\s+entity\b/si;
    my ($entity, $head) = ($1, $2);
    my %unit = (file => $file, generics => [], ports => [], range => {}, uses => []);
    my $generics = $head =~ /\bgeneric\s*\((.*?)\)\s*;\s*(?:port\b|$)/si ? $1 : '';
    my $ports = $head =~ /\bport\s*\((.*)\)\s*;/si ? $1 : '';
    for (split /;/, $generics) {
        next unless /\S/;
        if (/^\s*(\w+)\s*:\s*(\w+)\s*:=\s*(.*?)\s*$/s) { push @{$unit{generics}}, [$1, squeeze($3)] }
        else { complain("$file: generic not understood: " . squeeze($_)) }
    }
    for (split /;/, $ports) {
        next unless /\S/;
        my ($names, $dir, $type) = /^\s*([\w\s,]+?)\s*:\s*(in|out|inout)\s+(.*?)\s*$/s;
        my $width = defined $type ? width_of($type) : undef;
        if (!defined $width) { complain("$file: port not understood: " . squeeze($_)); next }
        push @{$unit{ports}}, map { [$_, $dir, $width] } split /\s*,\s*/, $names;
    }
    while ($text =~ /\bassert\s+(.*?)\s+report\s+"$entity: (G_\w+)(?:=|"\s*& "=")/sg) {
        my ($condition, $name) = (squeeze($1), $2);
        complain("$file: two assertions about $name") if exists $unit{range}{$name};
        $unit{range}{$name} = range_of($name, $condition);
    }
    while ($text =~ /\bentity\s+work\.(\w+)\s+generic\s+map\s*\((.*?)\)\s*port\s+map/sgi) {
        push @{$unit{uses}}, [$1, $2];
    }
    $entities{$entity} = \%unit;
    push @order, $entity;
}

sub find_range {
    my ($entity, $name) = @_;
    my $unit = $entities{$entity} or return undef;
    my $own = $unit->{range}{$name};
    return $own if defined $own && $own !~ /^`/;
    for my $use (@{$unit->{uses}}) {
        my ($child, $map) = @$use;
        next if $child eq $entity || $map !~ /(\w+)\s*=>\s*$name\s*(?:,|$)/;
        my $below = $1;
        next if defined $own && $below ne $name;
        my $range = find_range($child, $below) // next;
        $range =~ s/\b$below\b/$name/g;
        return defined $own ? "$range; $own" : $range;
    }
    return $own;
}

parse_entity($_) for @files;
if ($rows) {
    for my $entity (@order) {
        my $unit = $entities{$entity};
        print join("\t", $entity, 'generic', @$_, find_range($entity, $_->[0]) // 'any'), "\n" for @{$unit->{generics}};
        print join("\t", $entity, 'port', @$_), "\n" for @{$unit->{ports}};
    }
    exit $bad;
}

my ($checked_generics, $checked_ports) = (0, 0);
for my $entity (@order) {
    my $unit = $entities{$entity};
    my $page = "$docs/$entity.md";
    my $in;
    if (!open $in, '<', $page) { complain("$page: missing, the page of $unit->{file}"); next }
    my (%generic, %port, $table, %contract, $drawn);
    my $section = '';
    while (my $line = <$in>) {
        chomp $line;
        $section = $1 if $line =~ /^## (.*)/;
        $contract{$1} = 1 if $section eq 'Contract' && $line =~ /^\| ([a-z ]+) \| .*\S.* \|$/;
        $drawn = 1 if $section eq 'Diagram' && $line =~ /^(```text|!\[)/;
        if ($line !~ /^\|/) { $table = undef; next }
        my @cells = map { squeeze($_) } split /(?<!\\)\|/, $line, -1;
        shift @cells; pop @cells;
        my $head = join '|', @cells;
        if ($head eq 'generic|default|range|meaning, cost') { $table = 'generic'; next }
        if ($head eq 'port|dir|width|meaning') { $table = 'port'; next }
        complain("$page:$.: a table of " . $cells[0] . "s in another form than lint_tables.pl's")
            if $cells[0] =~ /^(generic|port)$/ && !defined $table;
        next if !defined $table || $head =~ /^[-:|]+$/;
        if (@cells != 4) { complain("$page:$.: " . scalar(@cells) . ' cells instead of 4'); next }
        complain("$page:$.: no meaning") if $cells[3] eq '';
        for my $name (split /, /, $cells[0]) {
            my $known = $table eq 'generic' ? \%generic : \%port;
            complain("$page:$.: $table $name a second time") if exists $known->{$name};
            $known->{$name} = [$., $cells[1], $cells[2]];
        }
    }
    $contract{$_} or complain("$page: no row '$_' in ## Contract")
        for 'rate', 'latency', 'formats', 'reset', 'corner cases', 'cost';
    complain("$page: nothing drawn in ## Diagram") unless $drawn;
    for (@{$unit->{generics}}) {
        my ($name, $default) = @$_;
        my $row = delete $generic{$name};
        if (!$row) { complain("$page: no row for generic $name of $unit->{file}"); next }
        my $range = find_range($entity, $name) // 'any';
        my $place = "$page:$row->[0]: generic $name";
        complain("$place: default '$row->[1]', in the entity '$default'") if $row->[1] ne $default;
        complain("$place: range '$row->[2]', by the assertions '$range'") if $row->[2] ne $range;
        $checked_generics++;
    }
    for (@{$unit->{ports}}) {
        my ($name, $dir, $width) = @$_;
        my $row = delete $port{$name};
        if (!$row) { complain("$page: no row for port $name of $unit->{file}"); next }
        complain("$page:$row->[0]: port $name: '$row->[1]', in the entity '$dir'") if $row->[1] ne $dir;
        complain("$page:$row->[0]: port $name: width '$row->[2]', in the entity '$width'") if $row->[2] ne $width;
        $checked_ports++;
    }
    complain("$page:$generic{$_}[0]: generic $_ is not in $unit->{file}") for sort keys %generic;
    complain("$page:$port{$_}[0]: port $_ is not in $unit->{file}") for sort keys %port;
    complain("$unit->{file}: no port was found") unless @{$unit->{ports}};
}
complain("lint_tables: nothing was checked: $checked_generics generics, $checked_ports ports")
    unless @order && $checked_generics && $checked_ports;
exit $bad;
