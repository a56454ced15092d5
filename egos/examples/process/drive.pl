#!/usr/bin/env perl
# A driver in Perl without modules: it keeps its lane and its distance. The protocol is in docs/egos-by-programs.md.
use strict;
use warnings;
$| = 1;    # flush every line

my %entry;     # name of an entry of the observation => its index
my $length;    # of the car, in metres

sub bounded { my ($low, $value, $high) = @_; return $value < $low ? $low : $value > $high ? $high : $value }

sub decide {
    my @seen = @_;
    my $of = sub { $seen[$entry{$_[0]}] };
    my $speed = $of->('speed_mps');
    my $steering = 0.5 * $of->('path_turned_rad@5m') + 0.5 * atan2($of->('path_left_m'), 4 + $speed);
    my $acceleration = bounded(-3, -8 * $of->('speed_over_limit'), 2);    # towards the speed limit
    for my $other (map { "other$_" } 0 .. 2) {
        next unless $of->("${other}_seen") && $of->("${other}_ahead_m") > 0 && abs($of->("${other}_left_m")) < 2.2;
        my $gap = $of->("${other}_ahead_m") - $length;
        my $following = 0.3 * ($gap - 2 - 1.5 * $speed) + 0.9 * $of->("${other}_ahead_mps");
        $acceleration = $following if $following < $acceleration;
    }
    return sprintf '[%.6f, %.6f]', bounded(-8, $acceleration, 3), $steering;
}

# Each message is one line of JSON with the keys in the order of docs/egos-by-programs.md.
while (my $line = <STDIN>) {
    if ($line =~ /"type": "hello"/) {
        my ($names) = $line =~ /"layout": \[(.*?)\]/;
        my $index = 0;
        %entry = map { $_ => $index++ } $names =~ /"(.*?)"/g;
        ($length) = $line =~ /"length_m": ([-+.\deE]+)/;
        print qq({"protocol": 2}\n);
    } elsif ($line =~ /"type": "reset"/) {
        print "{}\n";    # this driver has no state
    } else {
        my ($rows) = $line =~ /"observation": \[(.*?)\]\]/;
        my @actions = map { decide(/[-+.\deE]+/g) } split /\], \[/, $rows;
        print '{"actions": [', join(', ', @actions), "]}\n";
    }
}
