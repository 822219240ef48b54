/PROG  FANUC_PLAIN
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "P[1] in a comment";
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/MN
   1:  ! L P[9] a remark ;
   2:J P[1] 100% FINE    ;
   3:L P[2] 500mm/sec CNT100    ;
   4:L P[3:"over bin"] 500mm/sec FINE    ;
   5:  //L P[4] 100mm/sec FINE ;
/POS
P[1]{
   GP1:
    UF : 0, UT : 1,    
	J1=    0.000 deg,	J2=    10.000 deg,	J3=    -10.000 deg,
	J4=    0.000 deg,	J5=    -60.000 deg,	J6=    0.000 deg
};
P[2]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
	X =    8818.715  mm,	Y =    147.321  mm,	Z =    658.168  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
P[3:"over bin"]{
   GP1:
    UF : 0, UT : 1,        CONFIG : 'N U T, 0, 0, 0',
	X =    803.281  mm,	Y =    147.321  mm,	Z =    594.993  mm,
	W =  -180.000 deg,	P =    -30.000 deg,	R =     0.000 deg
};
/END
