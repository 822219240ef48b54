/PROG  FANUC_CONFIG
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "P[1] in a comment";
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/MN
   1:J P[1] 100% FINE ;
   2:L P[2] 500mm/sec FINE ;
   3:L P[3] 500mm/sec FINE ;
/POS
P[1]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'F U T, 0, 0, 0',
	X =    818.715  mm,	Y =    147.321  mm,	Z =    658.168  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
P[2]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 2',
	X =    818.715  mm,	Y =    147.321  mm,	Z =    658.168  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
P[3]{
   GP1:
    UF : 0, UT : 1,        
	X =    818.715  mm,	Y =    147.321  mm,	Z =    658.168  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
/END
